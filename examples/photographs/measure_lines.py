"""Measure the dark lines of dark_lines.csv on the photographs: `python measure_lines.py FOLDER`.

The pictures are those of a student laboratory, github.com/fmarrar/ae461 (commit 92a2bee); they are
not part of this project.  Millimetres are those of the beam's height, 25.4 mm by calipers, for the
rulers on the pictures read 6 to 8 % too much.  x is from the middle between the blocks that press
the beam, y from its upper edge.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

HEIGHT = 25.4
"""Of the beam, by calipers [mm]."""
LINES = {
    ("plain", 78): {-1: (1.0, 4.5), 0: (11.0, 14.0), 1: (20.0, 23.5)},
    ("plain", 126): {-1: (5.0, 8.5), 0: (11.0, 14.0), 1: (16.5, 20.0), 2: (22.5, 24.8)},
    ("plain", 133): {-1: (5.0, 8.5), 0: (11.0, 14.0), 1: (16.5, 20.0), 2: (22.0, 24.8)},
    ("notched", 53): {1: (20.0, 24.8)},
    ("notched", 78): {1: (18.0, 22.0)},
    ("notched", 105): {1: (16.0, 20.0), 2: (21.5, 24.8)},
    ("notched", 138): {1: (15.0, 18.9), 2: (19.5, 23.5)},
}
"""Dark lines by beam and load [N]: fringe orders, counted from the neutral axis downwards, and
between which y [mm] a line runs.  The notched beams under 14 and 36 N show none of order 1."""
REACH, STEP = 10.0, 1.0
"""Of the middle, to either side, and between columns that are taken [mm]."""
SMOOTH = (1.0, 2.5)
"""Deviations of the kernel that takes away grain and scratches, along y and x [pixels]."""


def beam(picture: np.ndarray) -> tuple[float, int, int]:
    """Column of the middle, and rows of the upper and the lower edge."""
    above = np.flatnonzero(np.median(picture[10:60], axis=0) < 12)  # of the blocks, in shadow
    widest = np.argmax(np.diff(above))
    left, right = above[widest], above[widest + 1]
    middle = (left + right) / 2
    beside = np.r_[left + 15 : int(middle - 40), int(middle + 40) : right - 15]  # not the notch
    rise = np.diff(np.median(picture[:, beside], axis=1))
    top = int(np.argmax(rise[: int(0.6 * len(picture))])) + 1
    fall = np.diff(np.median(picture[:, left:right], axis=1))
    start = top + int(0.8 * (right - left))
    return middle, top, start + int(np.argmin(fall[start:])) + 1


def dark_line(levels: np.ndarray, y: np.ndarray, low: float, high: float) -> float:
    """Middle of the darkest line between two y, at half of its depth, or not a number."""
    inside = np.flatnonzero((y > low) & (y < high))
    dark = inside[np.argmin(levels[inside])]
    if dark in (inside[0], inside[-1]):
        return np.nan
    near = int(2.5 / (y[1] - y[0]))
    above, below = levels[max(dark - near, 0) : dark].max(), levels[dark : dark + near].max()
    half = (levels[dark] + min(above, below)) / 2
    if levels[dark] > min(above, below) / 2:
        return np.nan
    first, last = dark, dark
    while levels[first] < half:
        first -= 1
    while levels[last] < half:
        last += 1
    upper = np.interp(half, levels[[first + 1, first]], y[[first + 1, first]])
    lower = np.interp(half, levels[[last - 1, last]], y[[last - 1, last]])
    return (upper + lower) / 2


folder = Path(sys.argv[1])
with open(Path(__file__).with_name("dark_lines.csv"), "w", newline="", encoding="utf-8") as file:
    table = csv.writer(file)
    table.writerow(["beam", "load_N", "order", "x_mm", "y_mm"])
    for (kind, load), lines in LINES.items():
        name = f"{'plain' if kind == 'plain' else 'unotch'}_{load}N.png"
        picture = np.asarray(Image.open(folder / name).convert("RGB"))[..., 1].astype(float)
        middle, top, bottom = beam(picture)
        pixel = HEIGHT / (bottom - top)
        smooth = gaussian_filter(picture, SMOOTH)
        for order, (low, high) in lines.items():
            for x in np.arange(-REACH, REACH + STEP / 2, STEP):
                levels = smooth[top:bottom, round(middle + x / pixel)]
                y = dark_line(levels, (np.arange(len(levels)) + 0.5) * pixel, low, high)
                if np.isfinite(y):
                    table.writerow([kind, load, order, f"{x:g}", f"{y:.2f}"])
