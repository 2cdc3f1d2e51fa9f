"""Energy must balance: what is supplied is stored, delivered or turned into heat."""

from typing import Any

import numpy as np
import pytest

from hdsim.drive.model import Model
from hdsim.drive.parameters import Drive
from hdsim.effects.kinematic_error import KinematicError
from hdsim.kernel import twist
from hdsim.parts import Builder, Part
from hdsim.scenario import Scenario
from hdsim.simulation.run import Run
from hdsim.simulation.setup import build_run

TURNS = 100
SPEED = 600.0  # rad/s

# Softer contacts than the default drive's: the same balance, with a slower ringing, in a quarter of the time.
LOSSLESS: dict[str, Any] = {
    "preset": "seed-2021-printed-roughness",
    "friction": {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0},
    "torsion": {"damping_nm_s_per_rad": 0.0},
}


class ErrorWithoutReaction(Part):
    """The kinematic error added to the twist, its derivatives withheld: the textbook mistake."""

    def contribute(self, build: Builder) -> None:
        build.twist(_without_reaction, [])


@twist
def _without_reaction(motor_angle, output_angle, parameters, error):  # type: ignore[no-untyped-def]
    error[0] += 3e-4 * np.sin(2.0 * motor_angle)


def coasting(
    drive: dict[str, Any], parts: list[Part], rtol: float = 1e-7, speed: float = SPEED, turns: int = TURNS
) -> Run:
    """A drive without losses that coasts for some input turns and swings a pendulum."""
    from hdsim.actuation.loads import GravityArm

    arm = GravityArm(mass_kg=2.0, centre_of_mass_m=0.3)
    model = Model(Drive.model_validate(drive), [*parts, arm], load_inertia_kg_m2=0.2)
    run = Run(
        model,
        duration_s=turns * 2 * np.pi / speed,
        sample_rate_hz=200,
        y0=model.initial_state(motor_velocity=speed),
        rtol=rtol,
    )
    for _ in run.blocks():
        pass
    assert run.failure is None
    return run


ROUGH = {"engagement": {"kind": "clearance"}, "gap_along_flank": True, "pitch_error_m": 1e-6}

# Without damping the ring rings for ever at 50 kHz, and every period must be integrated. A ring that is a
# hundred times heavier tests the same balance in a tenth of the time.
HEAVY_RING = {"inertia": {"ring_kg_m2": 1e-3}}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ring", "arrangement"),
    [
        ("dynamic", "circular_spline_fixed"),
        ("static", "flexspline_fixed"),
        pytest.param("dynamic", "flexspline_fixed", marks=pytest.mark.study),
        pytest.param("static", "circular_spline_fixed", marks=pytest.mark.study),
    ],
)
def test_without_losses_the_energy_does_not_drift(ring: str, arrangement: str) -> None:
    drive = LOSSLESS | HEAVY_RING | {"mesh": ROUGH | {"ring": ring}, "arrangement": arrangement}
    # The balance of an eliminated ring has corners where teeth meet: it needs the tighter tolerance.
    run = coasting(drive, [KinematicError()], rtol=1e-8 if ring == "static" else 1e-7)
    assert run.audit.exchanged > 1.0
    assert run.audit.relative < 1e-6


@pytest.mark.slow
def test_without_losses_the_energy_does_not_drift_with_the_ring_as_it_is() -> None:
    # As much a turn as 1e-6 in 100.
    assert coasting(LOSSLESS | {"mesh": ROUGH}, [KinematicError()], turns=40).audit.relative < 4e-7


@pytest.mark.parametrize(
    "mesh",
    [
        {"engagement": {"kind": "window"}},
        {"model": "tabulated"},
        {"model": "lumped"},
        {"model": "rigid"},
        {"contact": {"law": "hertz_line"}},
    ],
    ids=lambda mesh: str(next(iter(mesh.values()))),
)
def test_every_mesh_conserves_energy(mesh: dict[str, Any]) -> None:
    assert coasting(LOSSLESS | HEAVY_RING | {"mesh": mesh}, [KinematicError()]).audit.relative < 1e-6


def test_kinematic_error_without_its_reaction_torque_creates_energy() -> None:
    run = coasting(LOSSLESS | {"mesh": {"model": "lumped"}}, [ErrorWithoutReaction()], speed=100.0)
    assert run.audit.relative > 1e-4


def test_with_losses_the_audit_closes() -> None:
    scenario = Scenario.model_validate(
        {
            "drive": {"preset": "seed-2021", "mesh": {"damping_nm_s_per_rad": 1.0}},
            "effects": {
                "kinematic_error": {},
                "torsional_hysteresis_maxwell": {},
                "stribeck_friction": {},
                "load_side_friction": {},
                "thermal_friction": {},
                "motor_torque_ripple": {},
            },
            "command": {
                "motor": {
                    "type": "position",
                    "trajectory": {"type": "sine", "amplitude_deg": 20, "frequency_hz": 2},
                    "controller": {
                        "type": "cascade",
                        "position_gain_per_s": 40,
                        "velocity_gain_nm_s_per_rad": 0.025,
                        "velocity_integral_gain_nm_per_rad": 0.5,
                    },
                }
            },
            "load": {"inertia_kg_m2": 0.5, "torque": {"type": "sine", "amplitude_nm": 30, "frequency_hz": 3}},
            "run": {"duration_s": 1.0, "sample_rate_hz": 1000},
        }
    )
    run = build_run(scenario)
    recording = run.record()
    assert run.audit.relative < 1e-6
    assert recording["heat"][-1] > 0.01 * run.audit.exchanged
    assert np.all(np.diff(recording["heat"]) >= -1e-9)


@pytest.mark.parametrize(
    ("model", "arrangement", "seconds", "rtol"),
    [
        ("lumped", "circular_spline_fixed", 4.0, 1e-9),
        ("lumped", "flexspline_fixed", 4.0, 1e-9),
        ("teeth", "circular_spline_fixed", 2.0, 1e-7),
        ("teeth", "flexspline_fixed", 2.0, 1e-7),
    ],
)
def test_friction_grows_with_all_that_the_teeth_carry(
    model: str, arrangement: str, seconds: float, rtol: float
) -> None:
    """T_f = (T_c + c_L |tau / i|) sign(w_m), tau with the hysteresis: no damper."""
    found = build_run(
        Scenario.model_validate(
            {
                "drive": {
                    "preset": "seed-2021",
                    "arrangement": arrangement,
                    "mesh": {"model": model},
                    "torsion": {"damping_nm_s_per_rad": 0.0},
                    "friction": {
                        "coulomb_nm": 0.05,
                        "viscous_nm_s_per_rad": 0.0,
                        "load_coefficient": 0.3,
                        "smoothing_velocity_rad_per_s": 1e-3,
                    },
                },
                "effects": {"torsional_hysteresis_maxwell": {"slip_torque_nm": 12.0}},
                "command": {
                    "motor": {
                        "type": "motion",
                        "trajectory": {"type": "sine", "amplitude_deg": 15.0, "frequency_hz": 0.5},
                    },
                    "output": {"type": "locked"},
                },
                "load": {"inertia_kg_m2": 0.5},
                "run": {"duration_s": seconds, "sample_rate_hz": 200, "rtol": rtol},
            }
        )
    ).record()
    speed, torque = found["motor_velocity"], found["output_torque"]
    ratio = 100.0 if arrangement == "circular_spline_fixed" else 101.0
    expected = (0.05 + 0.3 * np.abs(torque) / ratio) * np.sign(speed)
    turning = np.abs(speed) > 0.1
    assert np.ptp(torque) > 40.0
    np.testing.assert_allclose(
        found["input_friction_torque"][turning], expected[turning], atol=0.002 * np.max(expected)
    )
