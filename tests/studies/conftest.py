"""A small, quick study: few tactels, few pixels, elements of low order."""

from pathlib import Path

import pytest

STUDY = """
design = "small.toml"
working_load = 1.0
mesh_order = 3

[[parameters]]
path = "transducer.compliant.thickness"
lowest = "0.3 mm"
highest = "1 mm"
scale = "log"
points = 3

[[parameters]]
path = "tactels.pitch"
lowest = "0.5 mm"
highest = "2.5 mm"
points = 3

[[parameters]]
path = "transducer.photoelastic.youngs_modulus"
lowest = "25 MPa"
highest = "150 MPa"

[sampling]
method = "latin-hypercube"
designs = 12

[search]
objective = "worst_uncertainty"
budget = 64
verify = 40

[constraints]
thickness = "3.5 mm"
strain = 0.1
"""


@pytest.fixture(scope="session")
def study_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from fringeforce import load_sensor

    folder = tmp_path_factory.mktemp("study")
    small = load_sensor("saad").replace(**{"tactels.count": 5, "camera.pixels": 256})
    # five tactels at 2.5 mm need 10 mm: a fifth of the pitches do not fit, and such designs fail
    short = small.replace(**{"transducer.length": "8.5 mm"})
    (folder / "small.toml").write_text(short.to_toml(), encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path
