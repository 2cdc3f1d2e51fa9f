"""A play as teeth: what no gear has is refused with the reason."""

import math

import pytest

from hdsim.drive.parameters import Drive
from hdsim.drive.play_as_teeth import play_as_teeth
from hdsim.errors import PhysicsError


def test_a_play_that_no_flanks_leave_is_refused() -> None:
    drive = Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": "lumped"}})
    with pytest.raises(PhysicsError, match=r"half-gap of \d"):
        play_as_teeth(drive, math.radians(3.3))
