"""What is not installed is named, with the line that installs it."""

import sys
from pathlib import Path

import pytest

import fringeforce as ff
from fringeforce.acquisition.cameras import gobject


def test_missing_debian_packages_are_named(
    model: ff.SensorModel, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "gi", None)
    monkeypatch.setattr(gobject, "DIST_PACKAGES", tmp_path)
    with pytest.raises(ff.FringeforceError, match="apt-get install aravis-tools"):
        ff.open_camera("aravis:", model)


def test_packages_for_another_python_are_told_apart(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "gi").mkdir()
    (tmp_path / "gi" / "_gi.cpython-27-x86_64-linux-gnu.so").touch()
    monkeypatch.delitem(sys.modules, "gi", raising=False)
    monkeypatch.setattr(gobject, "DIST_PACKAGES", tmp_path)
    with pytest.raises(ff.FringeforceError, match="not built for Python 3"):
        gobject.aravis()


def test_missing_pypylon_is_named_with_its_extra(
    model: ff.SensorModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pypylon", None)
    monkeypatch.setitem(sys.modules, "pypylon.pylon", None)
    with pytest.raises(ff.FringeforceError, match=r"pip install '\.\[pylon\]'"):
        ff.open_camera("pylon:", model)
