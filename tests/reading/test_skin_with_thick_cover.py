"""Narrow contacts on a skin whose cover is thick: frames of the exact series, read back."""

import numpy as np
import pytest

import fringeforce as ff

FAR = 5.0
"""Deviations: beyond them lies one in two million."""
HALF_EXTENT = 5e-3


@pytest.fixture(scope="module")
def reader() -> ff.Reader:
    """Of a strip whose cover is several times as thick as the contacts are wide."""
    sensor = ff.load_sensor("skin").replace(
        **{
            "transducer.edges": "roller",
            "transducer.length": "18 mm",
            "transducer.compliant.thickness": "1.6 mm",
            "skin.extent": 2 * HALF_EXTENT,
        }
    )
    return ff.Reader(ff.characterize(sensor))


def check(reader: ff.Reader, presses: list[ff.Press], seed: int) -> None:
    reading = reader.search(reader.model.expose(presses, rng=seed))
    assert reading.status is ff.Status.OK, presses
    total = reading.total
    assert total is not None
    normal, tangential = (
        sum(getattr(one, of) for one in presses) for of in ("normal", "tangential")
    )
    centre = sum(one.x * one.normal for one in presses) / normal
    off = np.array([*total.force, total.centre[0]]) - [normal, tangential, centre]
    assert (np.abs(off) < FAR * total.std[[0, 1, 5]]).all(), presses


@pytest.mark.parametrize("side", [-1, 1])
def test_narrow_contacts_beside_an_end_of_the_skin_are_read(reader: ff.Reader, side: int) -> None:
    for number, normal in enumerate((0.5, 1.0, 2.0, 4.0)):
        for width in (0.2e-3, 0.5e-3):
            x = side * (HALF_EXTENT - width / 2 - 0.1e-3)
            press = ff.Press(x=x, normal=normal, tangential=normal / 5, width=width)
            check(reader, [press], number)


def test_narrow_contacts_at_any_place_between_patches_are_read(reader: ff.Reader) -> None:
    for number, x in enumerate(np.linspace(-4e-3, 0.0, 9)):
        check(reader, [ff.Press(x=x, normal=4.0, tangential=-0.6, width=0.3e-3)], number)


def test_two_narrow_contacts_are_read(reader: ff.Reader) -> None:
    for number, apart in enumerate((4e-3, 5e-3, 6e-3, 7e-3)):
        two = [
            ff.Press(x=-apart / 2 - 0.3e-3, normal=0.6, tangential=0.1, width=0.4e-3),
            ff.Press(x=apart / 2 - 0.3e-3, normal=2.0, tangential=0.8, width=0.2e-3),
        ]
        check(reader, two, number)
