"""A sweep gives the same numbers wherever it runs, and loses nothing."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.studies.execution import Inline, completed, executor
from fringeforce.studies.outcome import sweep_result
from fringeforce.studies.result_store import DONE, FAILED, OPEN, read_results
from fringeforce.studies.study_file import load_study
from fringeforce.studies.sweep import Sweep, run_sweep

pytestmark = pytest.mark.slow

Columns = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def inline(study_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    study, sensor = load_study(study_path)
    return run_sweep(study, sensor, tmp_path_factory.mktemp("inline") / "r.h5", Inline())


def assert_same(one: Columns, other: Columns) -> None:
    assert one.keys() == other.keys()
    for name, values in one.items():
        np.testing.assert_array_equal(values, other[name], err_msg=name)


def test_a_pool_of_processes_gives_the_same_numbers(
    study_path: Path, inline: Sweep, tmp_path: Path
) -> None:
    study, sensor = load_study(study_path)
    seen: list[int] = []
    with executor(workers=2) as pool:
        found = run_sweep(
            study, sensor, tmp_path / "r.h5", pool, lambda _, done, count: seen.append(done)
        )
    assert_same(found.columns, inline.columns)
    assert seen == list(range(len(inline.columns["state"]) + 1))


def test_a_dask_cluster_of_two_workers_gives_the_same_numbers(
    study_path: Path, inline: Sweep, tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    study, sensor = load_study(study_path)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        executor(cluster.scheduler_address) as pool,
    ):
        found = run_sweep(study, sensor, tmp_path / "r.h5", pool)
    assert_same(found.columns, inline.columns)


def test_designs_that_fail_are_rows_with_their_errors(inline: Sweep) -> None:
    columns = inline.columns
    broken = columns["state"] == FAILED
    assert inline.failed == broken.sum() > 0
    assert all("outermost of 5 tactels" in text for text in columns["error"][broken])
    assert np.isnan(columns["worst_uncertainty"][broken]).all()
    assert np.isfinite(columns["worst_uncertainty"][~broken]).all()
    assert not inline.feasible[broken].any()
    too_long = 2 * columns["tactels.pitch"] >= 4.25e-3
    np.testing.assert_array_equal(broken, too_long)


def test_the_first_design_is_the_one_that_the_study_starts_from(inline: Sweep) -> None:
    assert inline.columns["transducer.compliant.thickness"][0] == 0.5e-3
    assert inline.columns["tactels.pitch"][0] == 1e-3
    assert inline.columns["thickness"][0] == 3.5e-3


def test_constraints_mark_designs_and_the_front_is_beaten_by_none(inline: Sweep) -> None:
    columns = inline.columns
    np.testing.assert_array_equal(
        inline.feasible, (columns["thickness"] <= 3.5e-3 * (1 + 1e-9)) & (columns["strain"] <= 0.1)
    )
    front = set(inline.pareto("worst_uncertainty", "largest_load").tolist())
    points = np.stack([columns["worst_uncertainty"], -columns["largest_load"]], axis=1)
    for i in np.flatnonzero(inline.feasible):
        no_worse = (points <= points[i]).all(axis=1) & (points != points[i]).any(axis=1)
        assert (i in front) == (not (no_worse & inline.feasible).any())


KILLED = """
import sys
from fringeforce.studies.execution import executor
from fringeforce.studies.study_file import load_study
from fringeforce.studies.sweep import run_sweep
if __name__ == "__main__":
    study, sensor = load_study(sys.argv[1])
    with executor(workers=1) as pool:
        run_sweep(study, sensor, sys.argv[2], pool, lambda *step: print(*step, flush=True))
"""


def test_a_sweep_killed_in_the_middle_keeps_every_finished_design(
    study_path: Path, inline: Sweep, tmp_path: Path
) -> None:
    script, results = tmp_path / "run.py", tmp_path / "r.h5"
    script.write_text(KILLED, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, script, study_path, results], stdout=subprocess.PIPE, text=True
    ) as running:
        assert running.stdout is not None
        for line in running.stdout:
            if int(line.split()[1]) >= 4:
                break
        running.send_signal(signal.SIGKILL)
        running.wait()
    kept = read_results(results)
    assert_flips_are_found(results)
    finished = kept["state"] != OPEN
    assert 4 <= finished.sum() < len(finished)
    seen: list[int] = []
    study, sensor = load_study(study_path)
    resumed = run_sweep(study, sensor, results, Inline(), lambda _, done, count: seen.append(done))
    assert seen[0] == finished.sum()
    for name, values in kept.items():
        np.testing.assert_array_equal(values[finished], resumed.columns[name][finished])
    assert_same(resumed.columns, inline.columns)


def test_a_flipped_bit_in_results_is_reported(
    study_path: Path, inline: Sweep, tmp_path: Path
) -> None:
    study, sensor = load_study(study_path)
    path = tmp_path / "r.h5"
    run_sweep(study, sensor, path, Inline())
    assert_flips_are_found(path)
    assert_same(run_sweep(study, sensor, path, Inline()).columns, inline.columns)


def assert_flips_are_found(path: Path) -> None:
    """No bit of a file can be flipped without a word; it is left as it was."""
    content, rng = path.read_bytes(), np.random.default_rng(0)
    for place in rng.integers(len(content) - 60, size=40):  # the checksum is at the end
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with pytest.raises(FileFormatError, match=r"r\.h5"):
            read_results(path)
    path.write_bytes(content)


def test_workers_end_when_the_process_that_started_them_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "run.py"
    script.write_text(
        "import os, time\n"
        "from fringeforce.studies.execution import executor\n"
        "if __name__ == '__main__':\n"
        "    with executor(workers=1) as pool:\n"
        "        print(pool.submit(os.getpid).result(), flush=True)\n"
        "        time.sleep(60)\n",
        encoding="utf-8",
    )
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        worker = int(running.stdout.readline())
        running.send_signal(signal.SIGKILL)
        running.wait()
    deadline = time.monotonic() + 20
    while alive(worker) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(worker)


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # an orphan that has ended stays listed until whoever adopted it looks
    state = Path(f"/proc/{process}/stat")
    return not state.exists() or state.read_text().rsplit(") ", 1)[1][0] != "Z"


def test_results_open_in_xarray_with_units(study_path: Path, tmp_path: Path) -> None:
    study, sensor = load_study(study_path)
    run_sweep(study, sensor, tmp_path / "r.h5", Inline())
    with xarray.open_dataset(tmp_path / "r.h5", engine="h5netcdf") as data:
        assert data["worst_uncertainty"].dims == ("design",)
        assert data["worst_uncertainty"].attrs["units"] == "N"
        assert data["tactels.pitch"].attrs["units"] == "m"
        assert int((data["state"] == DONE).sum()) > 0


def test_results_of_another_study_are_not_touched(study_path: Path, tmp_path: Path) -> None:
    study, sensor = load_study(study_path)
    run_sweep(study, sensor, tmp_path / "r.h5", Inline())
    before = (tmp_path / "r.h5").read_bytes()
    with pytest.raises(InputError, match="another study"):
        run_sweep(study.model_copy(update={"seed": 1}), sensor, tmp_path / "r.h5", Inline())
    assert (tmp_path / "r.h5").read_bytes() == before
    foreign = tmp_path / "foreign.h5"
    h5py.File(foreign, "w").close()
    with pytest.raises(FileFormatError, match="foreign"):
        run_sweep(study, sensor, foreign, Inline())


def test_a_sweep_says_what_it_found(inline: Sweep, tmp_path: Path) -> None:
    found = sweep_result(inline, "results")
    best = inline.columns["worst_uncertainty"][inline.feasible].min()
    assert f"{best * 1e3:.3g} mN" in found.text
    assert f"{inline.failed} that could not be computed" in found.text
    assert all(path.stat().st_size for path in found.save(tmp_path))


def test_results_come_with_their_numbers_from_any_executor() -> None:
    tasks = [(7, (2.0,)), (3, (5.0,))]
    with executor(workers=1) as pool:
        assert dict(completed(pool, np.sqrt, tasks)) == dict(completed(Inline(), np.sqrt, tasks))


def test_a_scheduler_that_is_not_there_is_named() -> None:
    pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    with pytest.raises(InputError, match="inproc"), executor("inproc://nowhere"):
        pass


def test_results_of_an_earlier_version_that_lacks_a_key_are_resumed(
    study_path: Path, tmp_path: Path
) -> None:
    study, sensor = load_study(study_path)
    run_sweep(study, sensor, tmp_path / "r.h5", Inline())
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        described = json.loads(str(file.attrs["study"]))
        assert described["design"]["transducer"]["photoelastic"].pop("material") is None
        file.attrs["study"] = json.dumps(described)
    assert run_sweep(study, sensor, tmp_path / "r.h5", Inline()).columns["state"].all()
