"""What is shipped works on its own: the wheel, outside the source tree.

Only fringeforce itself comes from the wheel.  Its dependencies are those that the tests run with: a
`.pth` file puts their folder behind the new environment's own, which needs no package index.  Such
a file does not run the `.pth` files of the folder that it names, so an editable installation of
the sources stays out of reach, and PYTHONPATH is not handed on.
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import urllib.request
from collections.abc import Mapping
from importlib.metadata import Distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[1]
CLIENT = """
import numpy as np

import fringeforce as ff

model: ff.SensorModel = ff.characterize(ff.load_sensor("saad"))
reading: ff.Reading = ff.Reader(model).read(model.expose(ff.polar(1.0, angle=10, n=11)))
total: float = float(np.sum(reading.forces))
good: bool = reading.status is ff.Status.OK
"""
WRONG = "model.newtons\nff.characterize(2)\nname: str = reading.chi2\n"


def _run(*command: object, cwd: Path, env: Mapping[str, str] | None = None) -> str:
    run = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
        env=env,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the source distribution and the wheel that was built from it."""
    folder = tmp_path_factory.mktemp("dist")
    build = (sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT)
    _run(*build, cwd=folder, env=_clean())
    return folder


@pytest.fixture(scope="module")
def installed(shipped: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment with the wheel in it."""
    home = tmp_path_factory.mktemp("outside") / "env"
    _run(sys.executable, "-m", "venv", "--without-pip", home, cwd=home.parent)
    python = home / "bin" / "python"
    (wheel,) = shipped.glob("*.whl")
    install = ("install", "--quiet", "--no-index", "--no-deps", "--no-compile", wheel)
    _run(sys.executable, "-m", "pip", "--python", python, *install, cwd=home.parent, env=_clean())
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    packages = home / "lib" / version / "site-packages"
    (packages / "dependencies.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    _take_compiled(packages)
    where = _run(python, "-c", "import fringeforce as f; print(f.__file__)", cwd=home, env=_clean())
    assert Path(where.strip()).is_relative_to(packages)
    return home / "bin"


def _take_compiled(packages: Path) -> None:
    """Let what was compiled for the sources, bytecode and loops, serve the same files of the wheel.

    Python and Numba tell by its size and time whether a file is the one that they compiled.
    """
    sources = ROOT / "src"
    for path in (sources / "fringeforce").rglob("*.py"):
        own = packages / path.relative_to(sources)
        assert own.read_bytes() == path.read_bytes()
        times = path.stat()
        os.utime(own, ns=(times.st_atime_ns, times.st_mtime_ns))
    for path in (sources / "fringeforce").rglob("__pycache__/*"):
        copy = packages / path.relative_to(sources)
        if copy.parent.parent.is_dir():  # a checkout may have caches of rooms that are gone
            copy.parent.mkdir(exist_ok=True)
            shutil.copy(path, copy)


def _clean() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def test_the_source_distribution_holds_what_a_wheel_is_made_of(shipped: Path) -> None:
    (archive,) = shipped.glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        names = {name.partition("/")[2] for name in tar.getnames()}
    wanted = {"pyproject.toml", "LICENSE", "designs/saad.toml", "src/fringeforce/py.typed"}
    assert wanted <= names
    assert not [name for name in names if "node_modules" in name or name.startswith("docs/_")]


def test_the_wheel_holds_all_that_the_sources_hold(installed: Path) -> None:
    """Templates, pages and tables as well: what the sources do, tests/test_report.py among them."""
    (packages,) = (installed.parent / "lib").glob("python3*/site-packages")
    places = {"src/fringeforce": "", "designs": "designs"}
    kept = {
        Path("fringeforce") / home / path.relative_to(ROOT / folder): path
        for folder, home in places.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
    }
    kept = {own: path for own, path in kept.items() if not {"__pycache__", "web"} & set(own.parts)}
    assert {path.suffix for path in kept} >= {".py", ".html", ".js", ".css", ".toml", ".typed"}
    assert all((packages / own).read_bytes() == path.read_bytes() for own, path in kept.items())


def test_forces_are_read_with_the_wheel(installed: Path, tmp_path: Path) -> None:
    program = installed / "fringeforce"
    (tmp_path / "forces.csv").write_text("tactel,normal_N,tangential_N\n6,1.0,0.1\n")
    for command in (
        "characterize saad -o model.h5",
        "simulate model.h5 forces.csv -o frames.h5",
        "read model.h5 frames.h5 -o readings.csv",
    ):
        _run(program, *command.split(), cwd=tmp_path, env=_clean())
    rows = (tmp_path / "readings.csv").read_text().splitlines()
    assert len(rows) == 12
    assert rows[6].endswith("OK")


def test_the_explorer_of_the_wheel_answers_and_has_its_bundle(
    installed: Path, tmp_path: Path
) -> None:
    server = subprocess.Popen(
        [installed / "fringeforce", "explore", "saad", "--no-browser"],
        cwd=tmp_path,
        env=_clean(),
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stdout is not None
        address = re.search(r"http://\S+", server.stdout.readline())
        assert address is not None
        with urllib.request.urlopen(address[0], timeout=60) as answer:
            page = answer.read().decode()
            cookie = answer.headers.get("Set-Cookie", "")
        # the page's own script, and those that it shares with other pages
        scripts = re.findall(r'(?:src|href)="\.?/?([^"]+\.js)[^"]*"', page)
        base = address[0].partition("?")[0].partition("#")[0].rstrip("/")
        size = 0
        for script in scripts:
            request = urllib.request.Request(f"{base}/{script}", headers={"Cookie": cookie})
            with urllib.request.urlopen(request, timeout=60) as answer:
                size += len(answer.read())
        assert size > 50_000
    finally:
        server.terminate()
        server.wait(timeout=60)
        if server.stdout is not None:
            server.stdout.close()


def test_types_reach_those_who_use_the_wheel(installed: Path, tmp_path: Path) -> None:
    checker = Path(sys.executable).parent / "pyrefly"
    options = ("--preset", "default", "--python-interpreter-path", installed / "python")
    (tmp_path / "client.py").write_text(CLIENT)
    (tmp_path / "wrong.py").write_text(CLIENT + WRONG)
    command = (checker, "check", *options, "client.py", "wrong.py")
    run = subprocess.run(
        command, cwd=tmp_path, env=_clean(), capture_output=True, text=True, check=False
    )
    assert set(re.findall(r"--> (\S+?):\d", run.stdout)) == {"wrong.py"}, run.stdout + run.stderr
    for rule in ("missing-attribute", "no-matching-overload", "bad-assignment"):
        assert rule in run.stdout


def test_extras_name_packages_that_the_constraints_pin(installed: Path) -> None:
    """Resolving them needs an index; that every name is pinned, and fits, does not."""
    folder = next((installed.parent / "lib").glob("python3*/site-packages"))
    found = next(
        one for one in Distribution.discover(path=[str(folder)]) if one.name == "fringeforce"
    )
    pins = dict(
        line.lower().replace("_", "-").split("==")
        for line in (ROOT / "constraints.txt").read_text().splitlines()
        if "==" in line
    )
    unpinned = set()
    for text in found.requires or ():
        needed = Requirement(text)
        name = needed.name.lower().replace("_", "-")
        if name != "fringeforce" and name not in pins:
            unpinned.add(name)
        elif name in pins:
            assert needed.specifier.contains(pins[name]), text
    # a vendor's, and those of rivals: never in the tests
    assert unpinned <= {"pypylon", "ngsolve", "scikit-learn"}
    with open(ROOT / "pyproject.toml", "rb") as file:
        groups = tomllib.load(file)["project"]["optional-dependencies"]
    assert set(found.metadata.get_all("Provides-Extra") or ()) == set(groups)
