"""Every public name has an example, and all examples do what they say; `ff` and `np` are known."""

import doctest
import pkgutil
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import fringeforce

pytestmark = pytest.mark.slow

FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def _expect_examples_to_hold(thing: object, name: str, needed: bool) -> None:
    known = {"ff": fringeforce, "np": np}
    found = doctest.DocTestFinder().find(thing, name, globs=known)
    examples = [test for test in found if test.examples]
    assert examples or not needed, f"{name} has no example"
    for test in examples:
        said: list[str] = []
        result = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=said.append)
        assert result.failed == 0, "".join(said)


@pytest.mark.parametrize("name", fringeforce.__all__)
def test_the_examples_of_a_public_name_hold(name: str) -> None:
    _expect_examples_to_hold(getattr(fringeforce, name), f"fringeforce.{name}", needed=True)


def _modules_with_examples() -> list[str]:
    """Modules with examples of names that are not public."""
    found = []
    public = {getattr(getattr(fringeforce, name), "__module__", "") for name in fringeforce.__all__}
    for module in pkgutil.walk_packages(fringeforce.__path__, "fringeforce."):
        spec = module.module_finder.find_spec(module.name, None)
        assert spec is not None
        assert spec.origin is not None
        if module.name not in public and ">>>" in Path(spec.origin).read_text(encoding="utf-8"):
            found.append(module.name)
    return found


@pytest.mark.parametrize("name", _modules_with_examples())
def test_the_examples_of_a_module_hold(name: str) -> None:
    _expect_examples_to_hold(import_module(name), name, needed=True)
