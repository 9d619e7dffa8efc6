"""Every public name has an example, and it does what it says; `ff` and `np` are as everywhere."""

import doctest
from pathlib import Path

import numpy as np
import pytest

import fringeforce

pytestmark = pytest.mark.slow

FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


@pytest.mark.parametrize("name", fringeforce.__all__)
def test_the_examples_of_a_public_name_hold(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    thing = getattr(fringeforce, name)
    found = doctest.DocTestFinder().find(
        thing, f"fringeforce.{name}", globs={"ff": fringeforce, "np": np}
    )
    examples = [test for test in found if test.examples]
    assert examples, f"{name} has no example"
    for test in examples:
        said: list[str] = []
        result = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=said.append)
        assert result.failed == 0, "".join(said)
