"""Effects of some arcseconds in a whole drive, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdsim.effects.wave_generator_bearing import BearingComponent, WaveGeneratorBearing
from hdsim.recording import Recording
from hdsim.scenario import Scenario
from hdsim.simulation.setup import build_run

STIFFNESS, TORQUE = 2e4, 30.0
ARCSEC = math.pi / 648000
FREE_OF_FRICTION = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}


def turned(effects: dict[str, Any], torque_nm: float, speed: float, **drive: Any) -> Recording:
    """A drive with a linear spring, its motor turned (rad/s) under a constant torque for two seconds."""
    run = build_run(
        Scenario.model_validate(
            {
                "drive": {
                    "preset": "seed-2021",
                    "mesh": {"model": "lumped"},
                    "torsion": {f"stiffness_k{k}_nm_per_rad": STIFFNESS for k in (1, 2, 3)}
                    | {"damping_nm_s_per_rad": 2.0},
                    "friction": FREE_OF_FRICTION,
                    **drive,
                },
                "effects": effects,
                "command": {
                    "motor": {
                        "type": "motion",
                        "trajectory": {"type": "ramp", "velocity_rad_per_s": speed},
                    }
                },
                "load": {"inertia_kg_m2": 0.05, "torque": {"type": "hold", "torque_nm": torque_nm}},
                "run": {
                    "duration_s": 2.0,
                    "sample_rate_hz": 500,
                    "rtol": 1e-8,
                    "start": {"motor_velocity_rad_per_s": speed},
                },
            }
        )
    )
    recording = run.record()
    assert run.audit.relative < 1e-6
    return recording


def test_an_error_that_grows_with_the_load_is_the_uneven_springs_wind_up() -> None:
    component = {"order": 2, "stiffness_nm_per_rad": 1500.0, "phase_deg": 30.0}
    effects = {"load_dependent_kinematic_error": {"components": [component]}}
    amplitudes = []
    for torque in (TORQUE, -TORQUE, 0.1 * TORQUE):
        r = turned(effects, torque, 2.0)
        late = r.time > 1.0
        motor = r["motor_angle"][late]
        uneven = 1500.0 * np.sin(2 * motor + math.radians(30))
        wind_up = torque / (STIFFNESS + uneven)
        assert r["output_angle"][late] == pytest.approx(-motor / 100 + wind_up, abs=0.05 * ARCSEC)
        # By virtual work: the load's power and the stored energy's rate, over the motor's speed.
        by_angle = 1500.0 * 2 * np.cos(2 * motor + math.radians(30))
        felt = torque / 100 + 0.5 * wind_up**2 * by_angle
        assert r["motor_torque"][late] == pytest.approx(felt, abs=2e-4 * abs(felt).max())
        amplitudes.append(0.5 * np.ptp(wind_up) / ARCSEC)
    assert amplitudes[0] == pytest.approx(TORQUE * 1500.0 / STIFFNESS**2 / ARCSEC, rel=0.01)
    assert amplitudes[0] == pytest.approx(amplitudes[1])
    assert amplitudes[0] == pytest.approx(10 * amplitudes[2])


def test_an_uneven_spring_is_softer_than_the_drives_own() -> None:
    """Beyond it the twist runs away; up to it the load hangs on what is left: TORQUE over 5 % of it."""

    def parts(second: float) -> dict[str, Any]:
        terms = [{"order": 2, "stiffness_nm_per_rad": 1.2e4}, {"order": 4, "stiffness_nm_per_rad": second}]
        return {"load_dependent_kinematic_error": {"components": terms}}

    r = turned(parts(0.7e4), TORQUE, 2.0)
    assert np.abs(r["output_angle"] + r["motor_angle"] / 100).max() < 1.5 * TORQUE / (0.05 * STIFFNESS)
    with pytest.raises(ValueError, match=r"components: found 2e\+04 N m/rad together, expected less than"):
        turned(parts(0.8e4), TORQUE, 2.0)
    rigid = turned(parts(0.8e4), TORQUE, 2.0, mesh={"model": "rigid"})
    assert rigid["output_angle"] == pytest.approx(-rigid["motor_angle"] / 100)


@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_friction_over_the_angle_is_felt_at_the_motor_and_all_of_it_is_heat(speed: float) -> None:
    component = {"order": 2, "amplitude_nm": 0.01, "phase_deg": 30.0}
    r = turned({"position_dependent_friction": {"components": [component]}}, 0.0, speed)
    level = 0.01 * (1 + np.sin(2 * r["motor_angle"] + math.radians(30)))
    late = r.time > 1.0
    assert r["motor_torque"][late] == pytest.approx(math.copysign(1.0, speed) * level[late], abs=1e-6)
    turned_by = 2 * r["motor_angle"] + math.radians(30)
    work = abs(0.01 * (r["motor_angle"] - 0.5 * (np.cos(turned_by) - np.cos(turned_by[0]))))
    assert r["heat"][late] == pytest.approx(work[late], rel=1e-3)


@pytest.mark.parametrize("mesh", ["lumped", "teeth"])
@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
def test_a_warm_drive_winds_up_by_as_much_more_as_its_steel_is_softer(mesh: str, arrangement: str) -> None:
    softer = {"stiffness_coefficient_per_k": 1e-3, "temperature_degc": 60.0}
    drive = {"mesh": {"model": mesh}, "arrangement": arrangement}
    winds = []
    for effects in ({}, {"thermal_stiffness": softer}):
        r = turned(effects, TORQUE, 0.0, **drive)
        winds.append(r["output_angle"][-1])
    # Of the whole wind-up: of teeth, contact and gap are no spring of steel, but hardly a hundredth.
    assert winds[1] / winds[0] == pytest.approx(1 / (1 - 0.04), rel=1e-5 if mesh == "lumped" else 2e-3)


def rolled(balls: int, ball: float, pitch: float, inner: float, outer: float) -> dict[str, float]:
    """Angles of a bearing whose balls roll on both rings, from the speeds at the points of contact."""
    inner_radius, outer_radius = 0.5 * (pitch - ball), 0.5 * (pitch + ball)
    centre = 0.5 * (inner * inner_radius + outer * outer_radius)  # the ball's, half way between the contacts
    cage = centre / (0.5 * pitch)
    spin = (outer * outer_radius - inner * inner_radius) / ball - cage  # against the cage
    return {
        "cage": cage,
        "outer_ring": balls * (cage - outer),
        "inner_ring": balls * (inner - cage),
        "larger_ball": 2 * (inner - cage),
        "ball_spin": abs(spin),
    }


@pytest.mark.parametrize("ratio", [-100.0, 101.0])
def test_orders_of_the_bearing_are_those_of_balls_that_roll(ratio: float) -> None:
    effect = WaveGeneratorBearing(balls=21, ball_to_pitch_diameter=3.0 / 30.0)
    output = 1.0 / ratio
    # The flexspline is the output, or it stands still.
    wanted = rolled(21, 3.0, 30.0, 1.0, output if ratio < 0 else 0.0)
    for place, angle in wanted.items():
        a, b = effect.angle_factors(BearingComponent(at=place), ratio)
        assert a + b * output == pytest.approx(angle, rel=1e-12)
