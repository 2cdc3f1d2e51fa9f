"""Where a prediction begins: wound up by what hangs on the drive, under the load that was measured there."""

import numpy as np
import pytest

from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

TIME = np.arange(0.0, 3.0, 0.002)


def base(**load) -> Scenario:
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": 1.0} | load,
        "run": {"duration_s": 1.0},
    })  # fmt: skip


def still(**more: np.ndarray) -> Record:
    """A joint that stands, as three sensors read it."""
    rng = np.random.default_rng(1)
    noise = {"motor_angle": 1e-5, "output_angle": 1e-6, "motor_torque": 1e-3}
    return Record("still", TIME, {c: s * rng.standard_normal(len(TIME)) for c, s in noise.items()} | more)


def output_angle(record: Record, scenario: Scenario) -> np.ndarray:
    bench = bench_for([record], [], scenario, None)
    predicted = dict(zip((s.channel for s in bench.series), bench.predict(state_of(scenario)), strict=True))
    return predicted["output_angle"]


def test_an_arm_that_is_held_up_hangs_still():
    """20 N m wind the drive up by 0.9 mrad. From the ideal gear's angle it would swing for seconds."""
    scenario = base(gravity={"mass_kg": 5.0, "centre_of_mass_m": 0.4, "hanging_angle_deg": 90.0})
    angle = output_angle(still(), scenario)
    torsion = scenario.drive.torsion
    weight = 5.0 * 0.4 * 9.80665
    first = torsion.torque_t1_nm / torsion.stiffness_k1_nm_per_rad
    wound = first + (weight - torsion.torque_t1_nm) / torsion.stiffness_k2_nm_per_rad
    assert np.ptp(angle) < 5e-7  # the motor encoder's noise over the ratio
    assert abs(angle.mean()) == pytest.approx(wound, rel=0.02)


def test_a_load_that_rises_from_nothing_has_not_been_there_before():
    """Led in at its first slope a ramp of 40 N m/s would begin half a second early, with 20 N m."""
    load = 40.0 * np.clip(TIME, 0.0, 0.5) + 0.05 * np.random.default_rng(2).standard_normal(len(TIME))
    angle = output_angle(still(load_torque=load), base())
    assert np.abs(angle[:10]).max() < 0.1 * np.abs(angle[-1])
