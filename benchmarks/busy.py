"""How long a cold reading takes on a busy machine: alone, and beside one program on every core.

    python benchmarks/busy.py [readings]

A plain script without environment variables reads frames of the shipped design as by
`Reader.search`.  First it has the machine to itself, as far as others leave it; then every core has
another program that never rests.  The processor is shared fairly, so twice the time is what nobody
can avoid.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import numpy as np

READINGS = 300
SCRIPT = """
import json, sys, time
import fringeforce as ff
model = ff.characterize(ff.load_sensor("saad"))
reader, forces = ff.Reader(model), ff.polar(1.5, angle=10, n=11)
reader.prepare()
times = []
for seed in range(int(sys.argv[1])):
    frame = model.expose(forces, rng=seed)
    start = time.perf_counter()
    reader.search(frame)
    times.append(time.perf_counter() - start)
print(json.dumps(times))
"""
LIMITS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def measure(readings: int) -> np.ndarray:
    """Median, 90 % point and largest time of a reading in a process of its own [ms]."""
    plain = {name: value for name, value in os.environ.items() if name not in LIMITS}
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(readings)],
        env=plain,
        capture_output=True,
        text=True,
        check=True,
    )
    return 1e3 * np.percentile(json.loads(run.stdout), [50, 90, 100])


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
    print(f"{'cold reading':<16}{'median':>10}{'90 %':>10}{'largest':>10}")
    for label, cells in (("alone, ms", alone), ("busy, ms", busy), ("ratio", busy / alone)):
        print(f"{label:<16}" + "".join(f"{cell:>10.1f}" for cell in cells))


if __name__ == "__main__":
    main()
