"""Records of benchmarks become the tables and the figures of the documentation."""

from pathlib import Path

import measured_figures
import numpy as np
import pytest
from records import aligned, boxed

from snippets import ROOT

MEASURED = ROOT / "docs" / "measured"
HEAD = "benchmarks/x.py\n2026-01-01; machine\nPython\n\n"


def test_a_table_in_a_box_keeps_rows_that_go_on_in_a_second_line(tmp_path: Path) -> None:
    box = (
        "┏━━━┳━━━┓\n┃ way ┃ frames/s ┃\n┡━━━╇━━━┩\n"
        "│ one │ 1,200 │\n│     │ or so │\n│ two │ - │\n└───┴───┘\n"
    )
    (tmp_path / "x.txt").write_text(HEAD + box, encoding="utf-8")
    (table,) = boxed(tmp_path / "x.txt")
    assert table.texts("way") == ["one", "two"]
    assert table.numbers("frames/s")[0] == 1200
    assert str(table.numbers("frames/s")[1]) == "nan"


def test_cells_belong_to_the_column_that_ends_where_they_do(tmp_path: Path) -> None:
    text = (
        "departure       OK  far     OK  far\n"
        "none           90%   1%    95%   0%\n"
        "lamp 3 % dim    0%         99%   2%\n\n"
        "words behind the table\n"
    )
    (tmp_path / "x.txt").write_text(HEAD + text, encoding="utf-8")
    table = aligned(tmp_path / "x.txt", "departure")
    assert table.texts("departure") == ["none", "lamp 3 % dim"]
    assert table.texts("far") == ["1%", ""]
    assert table.numbers("OK 2") == [95, 99]
    with pytest.raises(KeyError, match=r"no column 'inside'; there are departure, OK"):
        table.texts("inside")


@pytest.mark.parametrize(
    "name",
    sorted(path.stem for path in MEASURED.glob("*.txt") if path.stem in measured_figures.FIGURES),
)
def test_every_record_is_drawn(name: str, tmp_path: Path) -> None:
    made = measured_figures.save(MEASURED / f"{name}.txt", tmp_path)
    assert len(made) == len(measured_figures.FIGURES[name])
    assert all("<svg" in svg.read_text(encoding="utf-8") for svg in made)


def test_a_reliability_diagram_has_shares_of_frames_over_stated_probabilities(
    tmp_path: Path,
) -> None:
    text = (
        "probability        frames   stated    right   near\n"
        "0.5 to 0.7            120   0.6000   0.5000   0.02\n"
        "0.999 to 1          20000   0.9995   0.9998   1.00\n\n"
        "frames         number      OK\n"
        "strong           4000   99.0%\n"
    )
    (tmp_path / "reliability.txt").write_text(HEAD + text, encoding="utf-8")
    (axes,) = measured_figures.reliability(tmp_path / "reliability.txt").axes
    _, dots = axes.get_lines()[:2]
    stated, right = np.asarray(dots.get_data(), dtype=float)
    assert stated == pytest.approx([0.6, 0.9995])
    assert right[0] == pytest.approx(0.5, abs=1e-9)  # by symmetry
    assert 1 - right[1] == pytest.approx(4.17 / 20000, rel=0.01)  # median, 4 wrong


def test_a_record_of_another_shape_is_named(tmp_path: Path) -> None:
    (tmp_path / "creep.txt").write_text(HEAD + "reading  other\nnone  1\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"creep.txt is not as creep draws it: .*'rms'"):
        measured_figures.save(tmp_path / "creep.txt", tmp_path)
