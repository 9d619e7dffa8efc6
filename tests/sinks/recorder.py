"""Records for ever in a process of its own and says after each block what it has acknowledged.

Run as ``python recorder.py MODEL TARGET [BYTES]``; with BYTES no file may grow beyond that, as on
a full disk.
"""

import resource
import sys

import fringeforce as ff
from conftest import make_readings


def main(model: str, target: str, limit: str = "") -> None:
    sink = ff.open_sink(target, ff.load_model(model))
    if limit:
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), resource.RLIM_INFINITY))
    done = 0
    while True:
        sink.write(make_readings(done, 8))
        done += 8
        print(done, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
