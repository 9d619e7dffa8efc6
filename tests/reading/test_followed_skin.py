"""Contacts that are followed on a skin: frames of the exact series under moving cylinders."""

import numpy as np
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.models.presses import tractions

FRAMES = 120
RARE = 1e-6


def test_followed_contacts_lie_within_their_covariance() -> None:
    """A soft clear layer and a camera with little noise show what a linearisation leaves out."""
    sensor = ff.load_sensor("skin").replace(
        **{
            "transducer.edges": "roller",
            "transducer.compliant.thickness": "0.65 mm",
            "transducer.compliant.youngs_modulus": "24 MPa",
            "transducer.photoelastic.youngs_modulus": "37 MPa",
            "camera.pixels": 3000,
            "camera.noise": 1.0,
        }
    )
    model = ff.characterize(sensor)
    reader, rng = ff.Reader(model), np.random.default_rng(1)
    squares, tracked = list[float](), 0
    for turn in np.linspace(0, 1, FRAMES):
        normal = 0.9 - 0.6 * turn
        press = ff.Press(
            x=3e-3 - 0.4e-3 * np.sin(6 * turn),
            normal=normal,
            tangential=0.4 * normal * np.sin(7 * turn),
            radius=5e-3,
        )
        reading = reader.read(model.expose([press], rng=rng))
        assert reading.status is ff.Status.OK
        tracked += reading.tracked
        # shear moves the centre of pressure beside the axis of a cylinder
        part, total = tractions(sensor, press), reading.total
        assert total is not None
        off = np.array([*total.force, total.centre[0]])
        off -= [press.normal, press.tangential, part.centre]
        known = total.covariance[np.ix_([0, 1, 5], [0, 1, 5])]
        squares.append(float(off @ np.linalg.solve(known, off)))
    assert tracked > FRAMES / 2
    assert sum(squares) < chi2.isf(RARE, 3 * FRAMES)
    assert max(squares) < chi2.isf(RARE / FRAMES, 3)
