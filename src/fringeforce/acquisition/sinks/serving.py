"""Who may connect: this computer only, unless a token is asked for."""

from __future__ import annotations

from ipaddress import ip_address
from urllib.parse import urlsplit

from fringeforce.base.errors import InputError

LOOPBACK = "127.0.0.1"


def address(
    url: str, port: int, bind: str = LOOPBACK, token: str | None = None, tokens: bool = True
) -> tuple[str, int]:
    """Host and port to serve at.

    Parameters
    ----------
    url : str
        Such as "ws://127.0.0.1:8765"; host and port may be left out.
    port : int
        Where the URL names none.
    bind : str
        Host where the URL names none.
    token : str, optional
        What clients must show.
    tokens : bool
        False for protocols that know no token; they stay on this computer.

    Raises
    ------
    InputError
        If others could connect without a token, or the URL is none.
    """
    try:
        parts = urlsplit(url)
        host, found = parts.hostname or bind, port if parts.port is None else parts.port
    except ValueError as error:
        raise InputError(f"{url!r} is no address: {error}.") from None
    if is_loopback(host):
        return host, found
    if not tokens:
        raise InputError(
            f"{url}: {parts.scheme} knows no token, so it is served at {LOOPBACK} only; reach it "
            "from elsewhere through an SSH tunnel."
        )
    if not token:
        raise InputError(
            f"{host} can be reached by others: give --token, which clients then have to show, or "
            f"serve at {LOOPBACK}."
        )
    return host, found


def is_loopback(host: str) -> bool:
    """True if only this computer can reach a host."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
