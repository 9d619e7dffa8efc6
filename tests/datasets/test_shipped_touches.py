"""The shipped data set is what its study makes, and its README is true."""

import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from fringeforce.cli import app
from fringeforce.datasets.making import shards_of
from fringeforce.datasets.shard import examples
from fringeforce.datasets.study_file import load_dataset_study

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).parents[2] / "examples" / "dataset"
README = (FOLDER / "README.md").read_text(encoding="utf-8")


def test_the_shipped_images_are_those_of_the_study() -> None:
    study, pad = load_dataset_study(FOLDER / "touches.toml")
    for shard in shards_of(study, pad):
        made = examples(shard)
        with h5py.File(FOLDER / "touches" / shard.name) as file:
            images, forces = np.asarray(file["image"]), np.asarray(file["forces"])
            parts = list(np.asarray(file["split"]))
        grey = np.stack([one.image for one in made]).astype(int)
        # the last digit of an intensity may turn a rounding
        assert np.abs(grey - images).max() <= 1
        assert (grey != images).mean() < 1e-3
        np.testing.assert_allclose(forces, np.stack([one.forces for one in made]), atol=1e-6)
        assert parts == [one.part for one in made]


def test_the_example_is_small() -> None:
    assert sum(path.stat().st_size for path in FOLDER.rglob("*.*")) < 1_000_000


def test_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    shutil.copytree(FOLDER, tmp_path, dirs_exist_ok=True)
    (tmp_path / "sheet.png").unlink()
    monkeypatch.chdir(tmp_path)
    for command in re.findall(r"^fringeforce (.*)$", README, re.MULTILINE):
        result = CliRunner().invoke(app, shlex.split(command), catch_exceptions=False)
        assert result.exit_code == 0, result.output
        assert "0 of them made now" in result.output
    assert (tmp_path / "sheet.png").stat().st_size > 20_000
    names: dict[str, Any] = {}
    try:
        for block in re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL):
            exec(compile(block, "README.md", "exec"), names)
        assert names["images"].shape == (71, 1, 64, 64)
        assert names["forces"].shape == (71, 25, 3)
        assert (names["first"]["normal"] > 0).all()
    finally:
        for file in {
            id(f): f for data in (names["train"], names["test"]) for f, _ in data.rows
        }.values():
            file.close()
        names["file"].close()
