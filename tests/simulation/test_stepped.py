"""A joint advanced step by step: against formulas, against a run in one piece, bit by bit."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hdsim
from hdsim.errors import InputError
from hdsim.scenario import Scenario
from hdsim.simulation.run import RunFailed
from hdsim.simulation.simulate import simulate
from hdsim.simulation.stepped import SteppedPlant

FRICTIONLESS = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}
STEP = 1e-3
RUN = {"duration_s": 0.3, "sample_rate_hz": 1000, "rtol": 1e-8}


def scenario(mesh: str = "lumped", **sections: Any) -> Scenario:
    drive = {"preset": "csg-20-100", "mesh": {"model": mesh}} | sections.pop("drive", {})
    data = {
        "drive": drive,
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": 0.5},
        "run": RUN,
    }
    return Scenario.model_validate(data | sections)


def test_a_rigid_drive_follows_the_formulas_of_one_mass() -> None:
    one = scenario("rigid", drive={"friction": FRICTIONLESS})
    plant = SteppedPlant(one)
    motor, _, output = plant.model.inertias
    inertia = motor + output / one.drive.ratio**2
    for k in range(20):  # 1 N m/s
        plant.step(STEP, {"motor_torque": (k * STEP, (k + 1) * STEP)})
    t = plant.time_s
    angle, speed = t**3 / (6 * inertia), t**2 / (2 * inertia)
    found = plant.values(["motor_angle", "motor_velocity", "output_velocity"])
    assert found["motor_angle"] == pytest.approx(angle, rel=1e-9)
    assert found["motor_velocity"] == pytest.approx(speed, rel=1e-9)
    assert found["output_velocity"] == pytest.approx(speed / one.drive.ratio, rel=1e-9)
    plant.step(STEP, {"motor_torque": 0.0, "load_torque": -3.0})
    slower = speed - 3.0 / one.drive.ratio * STEP / inertia
    assert plant.values()["motor_velocity"] == pytest.approx(slower, rel=1e-9)


def test_a_twisted_spring_holds_against_the_prescribed_output() -> None:
    one = scenario(drive={"friction": FRICTIONLESS})
    plant = SteppedPlant(one, motor="motion", output="motion")
    stiffness = one.drive.torsion.stiffness_k1_nm_per_rad
    plant.step(STEP, {"prescribed_output_velocity": -0.1})
    damping = one.drive.torsion.damping_nm_s_per_rad
    assert plant.values()["output_torque"] == pytest.approx(0.1 * (stiffness * STEP + damping), rel=1e-6)
    assert plant.values()["output_angle"] == pytest.approx(-0.1 * STEP)


def deviations(one: Scenario, inputs: Any) -> dict[str, float]:
    """Largest deviation of a stepped run from one in a single piece, over the largest value."""
    whole = simulate(one)
    plant = SteppedPlant(one)
    names = ["motor_angle", "motor_velocity", "output_angle", "output_torque"]
    found = [plant.values(names)]
    for k in range(len(whole.time) - 1):
        plant.step(STEP, inputs(k * STEP, (k + 1) * STEP))
        found.append(plant.values(names))
    return {
        name: np.abs([one[name] for one in found] - whole[name]).max() / np.abs(whole[name]).max()
        for name in names
    }


def test_steps_under_torque_give_the_run_in_one_piece() -> None:
    ramp = {"type": "ramp", "rate_nm_per_s": 2.0, "duration_s": 0.2}
    against = {"type": "ramp", "rate_nm_per_s": -100.0, "duration_s": 0.1}
    one = scenario(
        effects={"kinematic_error": {}, "torsional_hysteresis_maxwell": {}},
        command={"motor": {"type": "torque", "torque": ramp}},
        load={"inertia_kg_m2": 0.5, "torque": against},
    )

    def inputs(t0: float, t1: float) -> dict[str, Any]:
        motor = 2.0 * min(t0, 0.2), 2.0 * min(t1, 0.2)
        return {"motor_torque": motor, "load_torque": (-100 * min(t0, 0.1), -100 * min(t1, 0.1))}

    assert max(deviations(one, inputs).values()) < 1e-6


def test_steps_under_a_commanded_angle_give_the_run_in_one_piece() -> None:
    a, v = 20.0, 2.0  # rad/s^2, rad/s: corners at 0.1 s and, after 0.2 rad more, at 0.2 s
    move = {
        "type": "trapezoid",
        "distance_deg": math.degrees(0.4),
        "maximum_velocity_deg_per_s": math.degrees(v),
    }
    move["maximum_acceleration_deg_per_s2"] = math.degrees(a)
    gains = {
        "position_gain_per_s": 40,
        "velocity_gain_nm_s_per_rad": 0.025,
        "velocity_integral_gain_nm_per_rad": 0.5,
    }
    servo = {
        "type": "position",
        "at": "output",
        "trajectory": move,
        "controller": {"type": "cascade", **gains},
    }
    one = scenario(command={"motor": servo})

    def inputs(t0: float, _: float) -> dict[str, Any]:
        k = round(t0 / STEP)
        if k < 100:
            return dict(zip(NAMES, (a * t0 * t0 / 2, a * t0, a), strict=True))
        if k < 200:
            return dict(zip(NAMES, (0.1 + v * (t0 - 0.1), v, 0.0), strict=True))
        t = t0 - 0.2
        rest = k >= 300
        return dict(
            zip(NAMES, (0.4, 0, 0) if rest else (0.3 + v * t - a * t * t / 2, v - a * t, -a), strict=True)
        )

    NAMES = ("commanded_angle", "commanded_velocity", "commanded_acceleration")
    assert max(deviations(one, inputs).values()) < 1e-6


def test_the_same_steps_give_the_same_bits() -> None:
    plant = SteppedPlant(scenario(effects={"torsional_hysteresis_maxwell": {}}))
    for k in range(5):
        plant.step(STEP, {"motor_torque": 0.1 * k})
    half = plant.state
    found = []
    for _ in range(2):
        plant.reset(half)
        for k in range(5):
            plant.step(STEP, {"load_torque": 3.0 * k})  # the motor torque is held
        found.append((plant.time_s, plant.values()))
    assert found[0] == found[1]
    plant.reset()
    assert plant.time_s == 0.0
    assert plant.values()["motor_angle"] == 0.0
    for k in range(5):
        plant.step(STEP, {"motor_torque": 0.1 * k})
    assert np.array_equal(plant.state.y, half.y)


def test_what_is_an_input_follows_from_the_scenario() -> None:
    locked = SteppedPlant(scenario(command={"motor": {"type": "locked"}, "output": {"type": "locked"}}))
    assert [name.split("_")[1] for name in locked.inputs] == ["motor"] * 3 + ["output"] * 3
    assert locked.inputs["prescribed_motor_velocity"] == "rad/s"
    free = SteppedPlant(scenario())
    assert free.inputs == {"motor_torque": "N m", "load_torque": "N m"}
    assert not free.inputs.keys() & free.outputs.keys()
    assert free.about.keys() == free.inputs.keys() | free.outputs.keys()


def test_mistakes_are_said() -> None:
    plant = SteppedPlant(scenario())
    for dt, inputs, said in [
        (0.0, {}, "found 0.0 s, expected a positive time"),
        (math.nan, {}, "expected a positive time"),
        (STEP, {"torque": 1.0}, "no input 'torque'; there are: motor_torque, load_torque"),
        (STEP, {"motor_torque": math.inf}, "motor_torque: found inf, expected finite numbers"),
    ]:
        with pytest.raises(InputError, match=said):
            plant.step(dt, inputs)
    with pytest.raises(InputError, match="motor input angle: found the motor command 'free'"):
        SteppedPlant(scenario(), motor="angle")
    moved = SteppedPlant(scenario(), output="motion")
    with pytest.raises(InputError, match="only a torque goes in a straight line"):
        moved.step(STEP, {"prescribed_output_angle": (0.0, 1.0)})


def test_a_step_that_fails_leaves_the_plant_at_its_begin() -> None:
    plant = SteppedPlant(scenario(), motor="torque")
    plant.step(STEP, {"motor_torque": 0.1})
    before = plant.values()
    with pytest.raises(RunFailed, match="RunawayError"):
        plant.step(1.0, {"motor_torque": 1e4})
    assert (plant.time_s, plant.values()["motor_angle"]) == (STEP, before["motor_angle"])
    plant.step(STEP, {"motor_torque": 0.0})


def test_an_arm_hangs_on_the_output_of_a_stepped_joint_too() -> None:
    pytest.importorskip("pinocchio")
    one = hdsim.load_scenario(Path(__file__).parents[2] / "scenarios" / "arms" / "joint_2.yaml")
    one = one.with_({"run.duration_s": 0.05, "run.sample_rate_hz": 1000})
    whole = simulate(one)
    command = one.command.motor.signal.data.values(whole.time, whole.time + 1e-9)  # type: ignore[union-attr]
    plant = SteppedPlant(one)
    found = [plant.values()["output_torque"]]
    for k in range(len(whole.time) - 1):
        names = ("commanded_angle", "commanded_velocity", "commanded_acceleration")
        plant.step(STEP, dict(zip(names, command[:3, k].tolist(), strict=True)))
        found.append(plant.values()["output_torque"])
    assert np.abs(whole["output_torque"]).max() > 50.0
    assert np.linalg.norm(found - whole["output_torque"]) < 0.01 * np.linalg.norm(whole["output_torque"])
