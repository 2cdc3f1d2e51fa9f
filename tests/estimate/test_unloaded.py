"""Where a locked drive carries nothing, and what its spring tells where nobody knows that exactly."""

import numpy as np
import pytest

from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.estimate.unloaded import unloaded_angle
from hdsim.scenario import Scenario

BASE = Scenario.model_validate({
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": {"motor": {"type": "free"}, "output": {"type": "locked"}},
    "load": {"inertia_kg_m2": 0.05},
    "run": {"duration_s": 1.0},
})  # fmt: skip


def wound(low_nm: float, high_nm: float, zero_nm: float = 0.0, back: float = -1.0) -> Record:
    """Slow ramps of torque against the locked output, the sensor with a zero, friction at the motor."""
    time = np.arange(0.0, 10.0, 0.002)
    torque = 0.5 * (low_nm + high_nm) + 0.5 * (high_nm - low_nm) * np.sin(1.3 * time)
    torsion, size = BASE.drive.torsion, np.abs(torque)
    within = np.minimum(size, torsion.torque_t1_nm) / torsion.stiffness_k1_nm_per_rad
    beyond = np.maximum(size - torsion.torque_t1_nm, 0.0) / torsion.stiffness_k2_nm_per_rad
    angle = np.sign(torque) * (within + beyond) * BASE.drive.ratio
    rng = np.random.default_rng(4)
    law = BASE.drive.friction
    friction = np.where(np.gradient(angle) > 0, 1.0, back)
    friction = friction * (law.coulomb_nm + law.load_coefficient * np.abs(torque / BASE.drive.ratio))
    return Record("wound", time, {
        "motor_angle": 1.0 + angle + 1e-5 * rng.standard_normal(len(time)),
        "motor_torque": torque / BASE.drive.ratio + friction + 1e-3 * rng.standard_normal(len(time)),
        "output_torque": torque + zero_nm + 0.02 * rng.standard_normal(len(time)),
    })  # fmt: skip


def test_the_outputs_torque_tells_where_a_drive_is_unwound():
    record = wound(-10.0, 16.0, back=-0.2)  # let go, the motor is not pulled back as hard
    found = unloaded_angle(record, record.filled("motor_angle"))
    # The motor's own torque holds friction that is not the same on both ways: 1.2 N m at the output.
    assert found == pytest.approx(1.0, abs=0.15 * 100.0 / BASE.drive.torsion.stiffness_k1_nm_per_rad)


def corner(record: Record):
    bench = bench_for([record], [], BASE, None)
    found = {one.name: one for one in refit(bench, state_of(BASE)).intervals}
    return found["drive.torsion.torque_t1_nm"]


def test_a_corner_that_is_passed_on_both_sides_is_told_by_them():
    """On one side alone a zero of the sensor looks like another corner, which widens the interval."""
    both = corner(wound(-15.0, 16.0, zero_nm=1.5))
    assert both.determined
    assert both.value == pytest.approx(BASE.drive.torsion.torque_t1_nm, rel=0.05)
    one = corner(wound(-5.0, 16.0, zero_nm=0.6))
    assert one.high - one.low > 3.0 * (both.high - both.low)
