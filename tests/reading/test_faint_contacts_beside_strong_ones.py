"""A faint contact on a skin, beside strong ones: frames of the exact series, read back."""

import numpy as np
import pytest

import fringeforce as ff

FAR = 5.0
"""Deviations: beyond them lies one in two million."""
FRAMES = 16


@pytest.fixture(scope="module")
def reader() -> ff.Reader:
    """Of a long strip before few pixels of much noise, which hardly show a light touch."""
    sensor = ff.load_sensor("skin").replace(
        **{
            "transducer.edges": "roller",
            "transducer.length": "30 mm",
            "transducer.compliant.thickness": "0.48 mm",
            "transducer.compliant.youngs_modulus": "19 MPa",
            "skin.extent": "24 mm",
            "camera.pixels": 565,
            "camera.noise": 4.0,
        }
    )
    return ff.Reader(ff.characterize(sensor))


def test_a_faint_contact_beside_strong_ones_is_found_or_in_doubt(reader: ff.Reader) -> None:
    presses = [
        ff.Press(x=0.75e-3, normal=1.68, tangential=-0.82, width=1.1e-3, profile="hertz"),
        ff.Press(x=4.2e-3, normal=0.8, tangential=-0.2, width=0.45e-3, profile="hertz"),
        ff.Press(x=9.5e-3, normal=0.3, tangential=-0.09, width=0.66e-3, profile="hertz"),
    ]
    force = np.sum([[one.normal, one.tangential] for one in presses], axis=0)
    readings = [reader.search(reader.model.expose(presses, rng=k)) for k in range(FRAMES)]
    sure = [one.total for one in readings if one.ok and one.total is not None]
    off = np.array([(total.force - force) / total.std[:2] for total in sure])
    assert len(sure) > FRAMES / 2
    assert np.abs(off).max() < FAR
