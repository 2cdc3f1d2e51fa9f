"""A drive in a joint of an arm that MuJoCo integrates as a whole: its torque is what inverse dynamics ask."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

import arm_forward as forward
import arm_plant as plant

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.records import Record


@pytest.mark.parametrize(
    ("joint", "hidden"),
    [
        (1, forward.Hidden()),
        (3, forward.Hidden(error_rad=2e-4, error_order=2.0, phase=0.4)),
        (1, forward.Hidden(ripple_nm=0.02, ripple_order=1.0)),
    ],
)
def test_the_motors_torque_is_what_inverse_dynamics_ask_of_the_simulated_motion(joint, hidden):
    run = forward.run(joint, hidden, 4.0, 0)
    time, angle = run["time"], run["motor_angle"]
    # It moves as a whole: no joint stands, and none is left behind.
    assert np.all(np.ptp(run["joints"], axis=0) > 0.2)
    assert np.max(np.abs(run["joints"] - plant.at(time, 0)[0])) < 0.01
    courses = [CubicSpline(time, run["joints"][:, k]) for k in range(6)]
    motion = np.array([[course(time, n) for course in courses] for n in range(3)]).transpose(0, 2, 1)
    motor = CubicSpline(time, angle)
    lever = 1 / plant.RATIO + np.array([hidden.error(a)[1] for a in angle])
    lost = [hidden.torque(a, w) for a, w in zip(angle, motor(time, 1), strict=True)]
    asked = plant.carried(motion)[:, joint] * lever + plant.ROTOR * motor(time, 2) + lost
    inside = slice(100, -100)
    assert asked[inside] == pytest.approx(run["motor_torque"][inside], abs=2e-3)


@pytest.mark.slow
@pytest.mark.study
def test_a_ripple_of_one_joint_is_named_beside_five_others_that_move():
    run = forward.run(1, forward.Hidden(ripple_nm=0.02, ripple_order=6.0, phase=1.0), 5.0, 3)
    rng = np.random.default_rng(0)
    noise = {"motor_torque": 2e-3, "motor_angle": 0.0}
    channels = {c: run[c] + s * rng.standard_normal(len(run["time"])) for c, s in noise.items()}
    others = {f"joint_{k + 1}": run["joints"][:, k] for k in range(6) if k != 1}
    record = Record("joint_2", run["time"], channels, joints=others)
    with tempfile.TemporaryDirectory() as folder:
        base = hdsim.load_scenario(plant.model(Path(folder), 1, plant.MASS))
    found = diagnose([record], base).verdict
    assert [effect.name for effect in found.effects] == ["motor_torque_ripple"]
    parameters = found.effects[0].parameters
    assert parameters["components.0.order"].value == 6.0
    assert parameters["components.0.cogging_nm"].value == pytest.approx(0.02, rel=0.1)
