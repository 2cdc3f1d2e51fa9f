"""Encoders whose zeros lie apart: weights at angles of the output, motor orders at angles of the motor."""

import numpy as np
import pytest

import hdsim
from hdsim.estimate.predict import Candidate, Predictor, plan_for
from hdsim.estimate.records import Record
from hdsim.estimate.zeros import between_zeros

RATIO = 101.0
SWING = 0.6  #: rad at the output
#: Whole turns and part of one by which the motor's zero is elsewhere, rad at the motor.
TURNS, PART = 7, 0.9

BASE = """
name: zeros
drive:
  rated_torque_nm: 100
  arrangement: flexspline_fixed
  geometry: {flexspline_teeth: 200, circular_spline_teeth: 202}
  torsion: {stiffness_k1_nm_per_rad: 3.0e4, stiffness_k2_nm_per_rad: 3.0e4, stiffness_k3_nm_per_rad: 3.0e4,
            torque_t1_nm: 14, torque_t2_nm: 48, damping_nm_s_per_rad: 60.0}
  inertia: {motor_kg_m2: 1.0e-4, wave_generator_kg_m2: 4.0e-5}
  friction: {coulomb_nm: 0.0, viscous_nm_s_per_rad: 0.0, load_coefficient: 0.0}
  mesh: {model: lumped}
command: {motor: {type: free}}
load:
  inertia_kg_m2: 1.0
  gravity: {mass_kg: 10.0, centre_of_mass_m: 0.5, hanging_angle_deg: 40}
effects:
  kinematic_error: {components: [{order: 2, amplitude_arcmin: 0.02, phase_deg: 30}]}
run: {duration_s: 1.0}
"""


def record(shift: float) -> Record:
    """A slow swing; the motor's encoder reads ``shift`` rad more than ratio times the output's."""
    t = np.arange(0.0, 4.0, 0.004)
    output = SWING * (1.0 - np.cos(np.pi * t / 2.0))
    motor = RATIO * output + shift
    return Record("swing", t, {"motor_angle": motor, "output_angle": output, "motor_torque": 0.0 * t + t})


@pytest.mark.parametrize("shift", [0.0, 2 * np.pi * TURNS, 2 * np.pi * TURNS + PART, -PART])
def test_turns_and_the_rest_make_up_what_lies_between_the_zeros(shift):
    turns, rest = between_zeros(record(shift), RATIO)
    assert abs(rest) <= np.pi / RATIO + 1e-9
    assert 2 * np.pi * turns / RATIO + rest == pytest.approx(-shift / RATIO, abs=1e-9)


@pytest.mark.parametrize("shift", [2 * np.pi * TURNS, 2 * np.pi * TURNS + PART])
def test_weight_is_at_the_output_encoders_angle_and_order_two_at_the_motors(tmp_path, shift):
    path = tmp_path / "base.yaml"
    path.write_text(BASE, encoding="utf-8")
    scenario = hdsim.load_scenario(path)
    swing = record(shift)
    predictor = Predictor(swing, plan_for(swing), RATIO)
    candidate = Candidate(scenario.drive, scenario.effects.active(), scenario.load)
    found = predictor.predict(candidate)
    # The weight's torque at the motor: m g l sin(theta - theta_0) over the ratio; inertia beside it.
    output = swing.channels["output_angle"]
    acceleration = SWING * (np.pi / 2.0) ** 2 * np.cos(np.pi * swing.time / 2.0)
    statics = 10.0 * 9.80665 * 0.5 * np.sin(output - np.radians(40.0)) + 1.0 * acceleration
    slow = statics / RATIO + 1.4e-4 * RATIO * acceleration
    rest = (found["motor_torque"] - slow)[swing.time > 0.2]
    assert np.std(rest) < 0.03 * np.std(slow)
    # The transmission error's phase is that of the motor's own reading.
    twist = found["output_angle"] - swing.channels["motor_angle"] / RATIO
    motor = swing.channels["motor_angle"]
    columns = np.column_stack([np.sin(2 * motor), np.cos(2 * motor), statics, np.ones_like(motor)])
    slowly = (np.abs(np.gradient(motor, swing.time)) < 12.0) & (swing.time > 0.2)
    (sine, cosine, *_), *_ = np.linalg.lstsq(columns[slowly], twist[slowly], rcond=None)
    assert np.degrees(np.arctan2(cosine, sine)) == pytest.approx(30.0, abs=8.0)
