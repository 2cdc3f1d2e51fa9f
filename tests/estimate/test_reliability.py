"""How finely an encoder of the output tells the rotor's motion: as the motor's torque answers it."""

import numpy as np
import pytest

from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record
from hdsim.estimate.reliability import APART_S, knots_apart_s
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

RATIO, INERTIA, PERIOD_S = 100.0, 2e-5, 1e-3
#: A vibration of the output, and how much of it the rotor does.
VIBRATES_HZ, VIBRATES_RAD = 90.0, 6e-5


def given(inertia=INERTIA):
    """A rigid drive with a rotor."""
    drive = {"preset": "csg-20-100", "mesh": {"model": "rigid"}}
    drive["inertia"] = {"motor_kg_m2": 0.7 * inertia, "wave_generator_kg_m2": 0.3 * inertia}
    rest = {
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": 0.1},
        "run": {"duration_s": 1.0},
    }
    return state_of(Scenario.model_validate({"drive": drive, **rest}))


def record(rotor_too, torque_noise=2e-4):
    """A joint with Coulomb friction whose output vibrates; the rotor does so too, or does not."""
    time = PERIOD_S * np.arange(6000)
    slow, fast = 2 * np.pi * np.array([0.5, VIBRATES_HZ])
    vibration = VIBRATES_RAD * np.sin(fast * time)
    angle = 0.8 * np.sin(slow * time) + 0.1 * np.sin(5 * slow * time) + vibration
    acceleration = -0.8 * slow**2 * np.sin(slow * time) - 2.5 * slow**2 * np.sin(5 * slow * time)
    acceleration = acceleration - rotor_too * fast**2 * vibration
    speed = np.gradient(angle - vibration, time)
    rng = np.random.default_rng(1)
    torque = (
        INERTIA * RATIO * acceleration + 0.01 * np.sign(speed) + torque_noise * rng.standard_normal(len(time))
    )
    channels = {"output_angle": angle + 1e-7 * rng.standard_normal(len(time)), "motor_torque": torque}
    return Record("joint", time, channels)


def test_an_output_that_vibrates_without_the_rotor_is_followed_slowly():
    [fine] = predictors([record(rotor_too=False)], RATIO)
    assert knots_apart_s(Bench([fine]), given()) == APART_S
    [slow] = predictors([record(rotor_too=False)], RATIO, apart_s=APART_S)
    truth = predictors([record(rotor_too=True)], RATIO)[0].motor_acceleration
    assert slow.samples_a_knot == pytest.approx(APART_S / PERIOD_S, rel=0.05)
    # It is the rotor's motion, up to the corners at which friction turns.
    inner = slice(500, -500)
    assert np.std((slow.motor_acceleration - fine.motor_acceleration)[inner]) > 300.0
    assert np.std((fine.motor_acceleration - truth)[inner]) < 20.0


@pytest.mark.parametrize("torque_noise", [2e-4, 0.02])
def test_a_rotor_that_vibrates_with_the_output_is_followed_finely(torque_noise):
    [fine] = predictors([record(rotor_too=True, torque_noise=torque_noise)], RATIO)
    assert knots_apart_s(Bench([fine]), given()) == 0.0


def test_several_records_are_asked_together_and_a_motors_own_encoder_is_not():
    output = record(rotor_too=False)
    own = Record("own", output.time, {
        "motor_angle": RATIO * output.channels["output_angle"],
        "motor_torque": output.channels["motor_torque"],
    })  # fmt: skip
    assert knots_apart_s(Bench(predictors([own], RATIO)), given()) == 0.0
    assert knots_apart_s(Bench(predictors([own, output], RATIO)), given()) == APART_S


def test_where_the_slow_motion_tells_no_inertia_the_given_one_counts():
    """The torque's noise hides it there: half of what the output does may be the rotor's, or all."""
    [fine] = predictors([record(rotor_too=True, torque_noise=0.3)], RATIO)
    bench = Bench([fine])
    assert knots_apart_s(bench, given()) == 0.0
    assert knots_apart_s(bench, given(4.0 * INERTIA)) == APART_S
