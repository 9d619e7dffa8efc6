"""How long a cold reading takes on a busy machine: alone, and beside one program on every core.

    python benchmarks/busy.py [readings]

A plain script without environment variables reads frames of the shipped design as by
`Reader.search`, and then a few images of the shipped pad.  First it has the machine to itself, as
far as others leave it; then every core has another program that never rests.  The processor is
shared fairly, so twice the time is what nobody can avoid.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import numpy as np

READINGS = 300
PAD_READINGS = 10
SCRIPT = """
import json, sys, time
import fringeforce as ff
times = {}
for name, readings in (("saad", int(sys.argv[1])), ("pad", int(sys.argv[2]))):
    model = ff.characterize(ff.load_sensor(name))
    reader, sensor = ff.Reader(model), model.sensor
    reader.prepare()
    forces = ff.polar(1.5, angle=10, n=sensor.tactels.total)
    if sensor.kind == "pad":
        forces = 0.3 * reader._single.trial_forces()
    frames = [model.expose(forces, rng=seed) for seed in range(readings)]
    times[name] = []
    for frame in frames:
        start = time.perf_counter()
        reader.search(frame).covariance
        times[name].append(time.perf_counter() - start)
print(json.dumps(times))
"""
LIMITS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def measure(readings: int) -> dict[str, np.ndarray]:
    """Median, 90 % point and largest time of strips and pads in a process of its own [ms]."""
    plain = {name: value for name, value in os.environ.items() if name not in LIMITS}
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(readings), str(PAD_READINGS)],
        env=plain,
        capture_output=True,
        text=True,
        check=True,
    )
    return {
        name: 1e3 * np.percentile(times, [50, 90, 100])
        for name, times in json.loads(run.stdout).items()
    }


def main() -> None:
    """Print the table."""
    readings = int(sys.argv[1]) if len(sys.argv) > 1 else READINGS
    measure(1)  # compiles what the first reading would wait for
    alone = measure(readings)
    others = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"])
        for _ in range(os.cpu_count() or 1)
    ]
    try:
        time.sleep(1)
        busy = measure(readings)
    finally:
        for other in others:
            other.kill()
    print(f"{'':<22}{'median':>10}{'90 %':>10}{'largest':>10}   ms")
    for name, label in (("saad", "strip"), ("pad", "pad")):
        for how, times in (("alone", alone[name]), ("busy", busy[name])):
            print(f"{label + ', ' + how:<22}" + "".join(f"{value:>10.1f}" for value in times))
        ratios = busy[name] / alone[name]
        print(f"{label + ', ratio':<22}" + "".join(f"{value:>10.1f}" for value in ratios))


if __name__ == "__main__":
    main()
