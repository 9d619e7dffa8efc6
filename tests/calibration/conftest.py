"""What tests of calibrations share."""

import pytest

from fringeforce.calibration import judgement


@pytest.fixture
def cause_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the seven fits that look for a cause; tests/calibration/test_bench.py has them."""
    monkeypatch.setattr(judgement, "_cause", lambda *_: "")
