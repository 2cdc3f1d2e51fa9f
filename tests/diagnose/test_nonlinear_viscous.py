"""Viscous friction that is no straight line over speed, by its own name: it had been taken for Stribeck's.

The plant is Newton's law of a rigid drive.
"""

from typing import Any

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario

from hdsim.diagnosis.workflow import diagnose

#: N m at the reference speed of 100 rad/s, and rad/s over which the sign is smoothed.
DRAG, SMOOTHING = 0.02, 0.5


def power(exponent: float) -> Any:
    """Friction that is a power of the motor's speed, N m."""
    return lambda angle, speed: DRAG * np.abs(speed / 100.0) ** exponent * np.tanh(speed / SMOOTHING)


@pytest.mark.parametrize("exponent", [0.5, 2.0])
def test_friction_that_is_a_power_of_speed_is_named_with_its_exponent(tmp_path: Any, exponent: float) -> None:
    record = rigid_record(20.0, noise=5e-4, extra=power(exponent))
    found = diagnose([record], scenario(tmp_path)).verdict
    [effect] = found.effects
    assert effect.name == "nonlinear_viscous_friction"
    assert effect.indistinguishable_from == []
    for name, true in (("speed_exponent", exponent), ("drag_nm", DRAG)):
        low, high = effect.parameters[name].interval
        assert low < true < high
    assert found.gap["motor_torque"].after == pytest.approx(5e-4, rel=0.05)


def test_friction_that_fades_with_speed_keeps_its_name(tmp_path: Any) -> None:
    def fading(angle: Any, speed: Any) -> Any:
        return 0.004 * np.exp(-((speed / 5.0) ** 2)) * np.tanh(speed / SMOOTHING)

    found = diagnose([rigid_record(20.0, noise=5e-4, extra=fading)], scenario(tmp_path)).verdict
    assert found.effects[0].name == "stribeck_friction"
    assert "nonlinear_viscous_friction" not in found.effects[0].indistinguishable_from


def test_friction_in_proportion_to_speed_is_a_number_of_the_drive(tmp_path: Any) -> None:
    found = diagnose([rigid_record(20.0, noise=5e-4, extra=power(1.0))], scenario(tmp_path)).verdict
    assert found.verdict == "parameter"
    assert "drive.friction.viscous_nm_s_per_rad" in found.moved


@pytest.mark.parametrize("churns", [False, True])
def test_it_is_a_departure_from_friction_that_is_there(tmp_path: Any, churns: bool) -> None:
    base = scenario(tmp_path, friction={"viscous_nm_s_per_rad": 0.0})
    record = rigid_record(20.0, noise=5e-4, **({"extra": power(2.0)} if churns else {}))
    found = diagnose([record], base).verdict
    first, *further = found.effects
    assert "input_coulomb_viscous" in (first.name, *first.indistinguishable_from)
    assert "nonlinear_viscous_friction" not in (first.name, *first.indistinguishable_from)
    assert [effect.name for effect in further] == (["nonlinear_viscous_friction"] if churns else [])
