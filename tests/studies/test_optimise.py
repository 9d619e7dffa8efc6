"""The search finds what is there, keeps to its limits, and its promise holds on noisy frames."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.studies.execution import Inline
from fringeforce.studies.optimise import cost, optimise
from fringeforce.studies.outcome import optimum_result
from fringeforce.studies.performance import performance
from fringeforce.studies.study_file import load_study
from fringeforce.studies.verification import verified

pytestmark = pytest.mark.slow


def test_the_best_design_meets_the_limits_and_is_the_best_of_all_tried(
    study_path: Path, tmp_path: Path
) -> None:
    study, sensor = load_study(study_path)
    counts: list[tuple[int, int]] = []

    def tell(_: str, done: int, count: int) -> None:
        counts.append((done, count))

    best = optimise(study, sensor, tmp_path / "r.h5", Inline(), tell)
    tried = best.sweep.columns["worst_uncertainty"]
    assert counts[-1] == (49, 49)
    assert best.performance.worst_uncertainty == tried[best.sweep.feasible].min()
    assert best.performance.worst_uncertainty < best.before.worst_uncertainty / 3
    assert best.performance.thickness <= 3.5e-3 * (1 + 1e-9)
    ranges = [best.sweep.columns[one.path] for one in best.sweep.axes]
    ends = [(one.value(0.0), one.value(1.0)) for one in best.sweep.axes]
    assert set(product(*ends)) <= set(zip(*ranges, strict=True)), "a corner was not tried"
    again = optimise(study, sensor, tmp_path / "r.h5", Inline())
    assert again.performance == best.performance
    assert again.sensor == best.sensor
    np.testing.assert_array_equal(again.sweep.columns["worst_uncertainty"], tried)
    frames = [verified(one, 1.0, np.random.SeedSequence(1), 40, Inline())
              for one in (sensor, best.sensor)]  # fmt: skip
    found = optimum_result(best, frames, "search")
    assert f"{best.performance.worst_uncertainty * 1e3:.3g} mN" in found.text
    share = 1 - best.performance.worst_uncertainty / best.before.worst_uncertainty
    assert f"{1e2 * share:.0f} % less than the" in found.text
    assert all(path.stat().st_size for path in found.save(tmp_path))


def test_any_design_within_the_limits_beats_any_beyond_them(model: ff.SensorModel) -> None:
    found = performance(model, 1.0, np.random.SeedSequence(0))
    inside = {"thickness": 3.6e-3, "strain": 0.1}
    little, much = {"thickness": 3.4e-3}, {"thickness": 1e-3}
    costs = [cost(found, "worst_uncertainty", limits) for limits in (inside, little, much)]
    assert costs[0] == found.worst_uncertainty
    assert costs == sorted(costs)
    assert cost("broken", "worst_uncertainty", inside) > costs[-1]
    assert cost(found, "largest_load", inside) == -found.largest_load


def test_readings_have_the_error_that_was_predicted(study_path: Path) -> None:
    _, sensor = load_study(study_path)
    found = verified(sensor, 1.0, np.random.SeedSequence(2), 200, Inline())
    assert found.read_right > 0.98
    # the root mean square of 200 errors is itself known to 1 / sqrt(400) = 5 %
    assert found.found == pytest.approx(found.predicted, rel=0.2)


def test_a_search_that_cannot_be_is_refused(study_path: Path, tmp_path: Path) -> None:
    study, sensor = load_study(study_path)
    assert study.search is not None
    with pytest.raises(InputError, match="no \\[search\\]"):
        optimise(study.model_copy(update={"search": None}), sensor, tmp_path / "r.h5", Inline())
    poor = study.search.model_copy(update={"budget": 10})
    with pytest.raises(InputError, match="budget = 10"):
        optimise(study.model_copy(update={"search": poor}), sensor, tmp_path / "r.h5", Inline())
