"""Measure the profiles of profiles.csv on the photographs: `python measure.py FOLDER`.

The pictures are those of a student laboratory, github.com/fmarrar/ae461 (commit 92a2bee); they are
not part of this project.  Of each, the green channel is taken between the beam's edges, in columns
between the upper pins; the median over the columns leaves scratches and annotations out.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from PIL import Image

BOXES = {
    35: (330, 600, 69, 373),
    78: (420, 700, 97, 402),
    126: (350, 640, 80, 385),
    133: (340, 635, 105, 411),
}
"""Columns and rows of the beam by the load that is written on the picture [N]: left and right of
what is taken, its upper and its lower edge, where the level changes most."""

folder = Path(sys.argv[1])
with open(Path(__file__).with_name("profiles.csv"), "w", newline="", encoding="utf-8") as file:
    table = csv.writer(file)
    table.writerow(["load_N", "row", "grey"])
    for load, (left, right, top, bottom) in BOXES.items():
        picture = np.asarray(Image.open(folder / f"plain_{load}N.png").convert("RGB"))
        levels = np.median(picture[top:bottom, left:right, 1], axis=1)
        table.writerows([load, row, f"{level:g}"] for row, level in enumerate(levels))
