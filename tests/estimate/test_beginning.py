"""A log that begins while the load still swings: its start is nobody's to know, and no number's to follow."""

import numpy as np
import pytest
from noisy import noisy

import hdsim
from hdsim.estimate.beginning import LATEST, STRETCHES, beginnings, hear_beginning
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

NOISE = {"motor_angle": 1e-4, "motor_torque": 1.8e-3, "output_angle": 3e-6}
# The command's sine begins at its full speed, which sets the load swinging.
SCENARIO = Scenario.model_validate({
    "drive": {"preset": "csg-14-50", "mesh": {"model": "lumped"}},
    "command": {"motor": {
        "type": "position",
        "at": "output",
        "trajectory": {"type": "sine", "amplitude_deg": 22.0, "frequency_hz": 0.31},
        "controller": {
            "type": "cascade",
            "position_gain_per_s": 30,
            "velocity_gain_nm_s_per_rad": 0.0094,
            "velocity_integral_gain_nm_per_rad": 0.19,
        },
    }},
    "load": {"inertia_kg_m2": 0.1875, "gravity": {"mass_kg": 1.5, "centre_of_mass_m": 0.3}},
    "run": {"duration_s": 15.0, "sample_rate_hz": 500.0},
})  # fmt: skip


def measured(begins_s: float) -> Record:
    """The scenario's run from a time on."""
    run = hdsim.simulate(SCENARIO)
    return noisy(run, NOISE, seed=1, begins_s=begins_s)


@pytest.mark.slow
@pytest.mark.parametrize("begins_s", [0.0, 5.0])
def test_a_vibration_at_the_beginning_bends_no_number(begins_s):
    """At 0 in the log; at 5 s only what the prediction's lead-in, without acceleration, leaves of one."""
    bench = bench_for([measured(begins_s)], [], SCENARIO, None)
    found = {one.name: one for one in refit(bench, state_of(SCENARIO)).intervals}
    # Counted, that at 0 leaves a spring softer by a third, and half as much again of motor torque.
    assert found["drive.torsion.stiffness_k1_nm_per_rad"].value == pytest.approx(3400.0, rel=0.06)
    assert found["motor_torque_gain"].value == pytest.approx(1.0, abs=0.06)
    if begins_s == 0.0:
        [said] = beginnings(bench)
        assert said.kind == "beginning"
        assert 0.2 < bench.begins_s[0] <= 15.0 * LATEST / STRETCHES


@pytest.mark.slow
def test_a_vibration_that_takes_a_fifth_of_a_short_record_bends_no_damping():
    """While the drive rests at its reversals the motor's torque leaves more than the vibration does."""
    given = SCENARIO.model_dump(mode="json", exclude_unset=True)
    given["load"]["inertia_kg_m2"], given["run"] = 0.075, {"duration_s": 5.0, "sample_rate_hz": 1000.0}
    scenario = Scenario.model_validate(given)
    noise = {"motor_angle": 2e-5, "motor_torque": 5e-4, "output_angle": 2e-6}
    bench = bench_for([noisy(hdsim.simulate(scenario), noise, seed=1)], [], scenario, None)
    found = {one.name: one for one in refit(bench, state_of(scenario)).intervals}
    for name, tolerance in (("stiffness_k1", 0.01), ("damping", 0.2)):
        own = found[f"drive.torsion.{name}_nm{'_s' * (name == 'damping')}_per_rad"]
        assert own.value == pytest.approx(own.start, rel=tolerance)


def test_by_chance_one_beginning_in_ninety_one_is_left_out_for_each_channel():
    bench = bench_for([measured(5.0)], [], SCENARIO, None)
    own = bench.predict(state_of(SCENARIO))
    rng, heard = np.random.default_rng(2), 0
    kept = [(series.train, series.hold) for series in bench.series]
    for _ in range(400):
        for series, predicted, (train, hold) in zip(bench.series, own, kept, strict=True):
            series.measured = predicted + rng.standard_normal(len(predicted))
            series.train, series.hold = train, hold
        heard += hear_beginning(bench, own)
    # Of 400 with a chance of 2/91, two channels: beyond that in two cases of a thousand.
    assert 1 <= heard <= 19
