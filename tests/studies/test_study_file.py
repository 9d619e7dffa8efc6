"""Study files are read as they are written, and what is wrong with them is said."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.studies.sampling import axis, designs
from fringeforce.studies.study_file import DesignSampling, Parameter, load_study

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "studies").glob("*.toml"))
PATH = "transducer.compliant.thickness"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_shipped_studies_are_valid(path: Path) -> None:
    study, sensor = load_study(path)
    axes = [axis(parameter, sensor) for parameter in study.parameters]
    assert designs(study.sampling, axes, np.random.SeedSequence(0))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seed = 0", "sed = 0", ["sed is not a key", "'seed'"]),
        ('lowest = "0.2 mm"', "", [PATH, "either lowest and highest"]),
        ('path = "transducer.compliant.thickness"', 'pth = "x"', ["parameters.0.path is missing"]),
        ("designs = 1000", "designs = 0", ["sampling.designs = 0", "1 or more"]),
        ('method = "latin-hypercube"', 'method = "random"', ["sampling.method", "'sobol'"]),
        ('thickness = "3.5 mm"', "thickness = 3.5", ["constraints.thickness = 3.5", "unit"]),
        ('design = "saad"', 'design = "sad"', ["no design"]),
    ],
)
def test_a_mistake_is_named_with_its_place(
    old: str, new: str, words: list[str], tmp_path: Path
) -> None:
    text = EXAMPLES[0].read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "study.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_study(path)
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"path": "transducer.colour", "lowest": 1, "highest": 2}, "names no value"),
        ({"path": "transducer.compliant", "lowest": 1, "highest": 2}, "names no value"),
        ({"path": PATH, "lowest": 1, "highest": 2}, "bare number"),
        ({"path": PATH, "lowest": "1 kg", "highest": "2 mm"}, "not a quantity"),
        ({"path": PATH, "lowest": "2 mm", "highest": "1 mm"}, "below"),
        ({"path": "transducer.edges", "lowest": 1, "highest": 2}, "choices"),
    ],
)
def test_a_parameter_that_no_design_has_is_named(
    values: dict[str, Any], words: str, sensor: ff.Sensor
) -> None:
    with pytest.raises(InputError, match=words):
        axis(Parameter(**values), sensor)


def test_a_grid_has_every_combination_once(sensor: ff.Sensor) -> None:
    axes = [
        axis(Parameter(path=PATH, lowest="0.1 mm", highest="1 mm", scale="log", points=3), sensor),
        axis(Parameter(path="tactels.count", lowest=5, highest=7, points=9), sensor),
        axis(Parameter(path="transducer.edges", choices=["free", "roller"]), sensor),
    ]
    found = designs(DesignSampling(method="grid"), axes, np.random.SeedSequence(0))
    assert len({tuple(one.values()) for one in found}) == len(found) == 3 * 3 * 2
    middle = sorted({one[PATH] for one in found})[1]
    assert middle == pytest.approx(np.sqrt(0.1 * 1) * 1e-3)
    assert {one["tactels.count"] for one in found} == {5, 6, 7}


@pytest.mark.parametrize("method", ["latin-hypercube", "sobol"])
def test_samples_fill_every_axis_evenly_and_depend_on_the_seed(
    method: str, sensor: ff.Sensor
) -> None:
    axes = [axis(Parameter(path=PATH, lowest="1 mm", highest="2 mm"), sensor)]
    sampling = DesignSampling.model_validate({"method": method, "designs": 16})
    first, again, other = (
        [one[PATH] for one in designs(sampling, axes, np.random.SeedSequence(seed))]
        for seed in (0, 0, 1)
    )
    assert first == again != other
    cells = np.floor((np.array(first, dtype=float) - 1e-3) / 1e-3 * 16).astype(int)
    assert sorted(cells.tolist()) == list(range(16))
