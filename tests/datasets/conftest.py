"""A small data set that several tests share, made in this process."""

from pathlib import Path

import pytest

from fringeforce.datasets.making import Dataset, run_dataset
from fringeforce.datasets.shard import _model
from fringeforce.datasets.study_file import DatasetStudy, load_dataset_study
from fringeforce.design.pad import Pad
from fringeforce.models.pad import PadModel
from fringeforce.studies.execution import Inline

EXAMPLE = Path(__file__).parents[2] / "examples" / "dataset"


@pytest.fixture(scope="session")
def touches() -> tuple[DatasetStudy, Pad]:
    """The study of the example, with fewer images."""
    study, pad = load_dataset_study(EXAMPLE / "touches.toml")
    assert isinstance(pad, Pad)
    return study.model_copy(update={"number": 10, "shard": 4}), pad


@pytest.fixture(scope="session")
def pad_model(touches: tuple[DatasetStudy, Pad]) -> PadModel:
    model = _model(touches[1].to_toml())
    assert isinstance(model, PadModel)
    return model


@pytest.fixture(scope="session")
def made(touches: tuple[DatasetStudy, Pad], tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return run_dataset(*touches, tmp_path_factory.mktemp("touches"), Inline())
