"""Units of torque, against the definitions of the pound, the inch and standard gravity."""

import pytest

from hdsim.log.units import TORQUE_UNITS


def test_torques_in_pounds() -> None:
    pound_force_n = 0.45359237 * 9.80665
    assert TORQUE_UNITS["lbf in"] == pytest.approx(pound_force_n * 0.0254, rel=1e-12)
    assert TORQUE_UNITS["lbf ft"] == pytest.approx(pound_force_n * 0.3048, rel=1e-12)
    assert TORQUE_UNITS["kN m"] == 1e3
