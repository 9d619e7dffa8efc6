"""Designs that the package ships, by name."""

from __future__ import annotations

from pathlib import Path


def shipped_designs() -> dict[str, Path]:
    """Designs of strips that the package ships, by name."""
    return _shipped("*.toml")


def shipped_pads() -> dict[str, Path]:
    """Designs of planar pads that the package ships, by name."""
    return _shipped("pads/*.toml")


def _shipped(pattern: str) -> dict[str, Path]:
    here = Path(__file__).parents[1]
    # beside the modules in an installed package, at the top of a source tree
    folder = next(f for f in (here / "designs", here.parents[1] / "designs") if f.is_dir())
    return {path.stem: path for path in sorted(folder.glob(pattern))}
