"""The assembled Jacobian and time derivative against central differences, for every mesh and arrangement."""

from typing import Any

import numpy as np
import pytest

from hdsim.scenario import Scenario
from hdsim.simulation.setup import build_model

EFFECTS: dict[str, Any] = {
    "kinematic_error": {},
    "stribeck_friction": {},
    "lugre_friction": {},
    "nonlinear_viscous_friction": {"speed_exponent": 0.5},
    "torsional_hysteresis_maxwell": {},
    "thermal_friction": {},
    "output_eccentricity": {},
    "tooth_error": {"member": "circular_spline", "tooth": 3.4, "shift_um": 8.0},
    "load_side_friction": {},
    "unbalance": {},
}
SERVO: dict[str, Any] = {
    "type": "position",
    "trajectory": {"type": "sine", "amplitude_deg": 10, "frequency_hz": 3},
    "controller": {
        "type": "cascade",
        "position_gain_per_s": 40,
        "velocity_gain_nm_s_per_rad": 0.02,
        "velocity_integral_gain_nm_per_rad": 0.5,
    },
}
MOTION: dict[str, Any] = {
    "type": "motion",
    "trajectory": {"type": "sine", "amplitude_deg": 200, "frequency_hz": 3},
}


def system_of(mesh: dict[str, Any], arrangement: str, motor: dict[str, Any], output: dict[str, Any]) -> Any:
    return build_model(
        Scenario.model_validate(
            {
                "drive": {"preset": "seed-2021", "arrangement": arrangement, "mesh": mesh},
                "effects": EFFECTS,
                "command": {"motor": motor, "output": output},
                "load": {
                    "inertia_kg_m2": 0.5,
                    "torque": {"type": "sine", "amplitude_nm": 20, "frequency_hz": 7},
                    "gravity": {"mass_kg": 2, "centre_of_mass_m": 0.2},
                },
                "run": {"duration_s": 1.0},
            }
        )
    ).system


@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
@pytest.mark.parametrize("motor", [SERVO, MOTION], ids=["servo", "motion"])
@pytest.mark.parametrize(
    "mesh",
    [
        {},
        {"engagement": {"kind": "clearance"}, "damping_nm_s_per_rad": 2.0},
        {"ring": "static"},
        {"model": "tabulated", "twist_nodes": 120, "angle_nodes": 120},
        {"model": "lumped"},
        {"model": "rigid"},
    ],
    ids=["teeth", "clearance", "static", "tabulated", "lumped", "rigid"],
)
def test_jacobian_and_time_derivative_are_exact(
    mesh: dict[str, Any], arrangement: str, motor: dict[str, Any]
) -> None:
    check(system_of(mesh, arrangement, motor, {"type": "free"}))


@pytest.mark.parametrize("mesh", [{}, {"model": "lumped"}], ids=["teeth", "lumped"])
def test_prescribed_output(mesh: dict[str, Any]) -> None:
    check(system_of(mesh, "circular_spline_fixed", {"type": "free"}, MOTION | {"at": "motor"}))


def check(system: Any) -> None:
    rng = np.random.default_rng(3)
    n = system.size
    for _ in range(3):
        y = system.y0 + rng.normal(size=n) * 0.3 * system.scale
        t = float(rng.uniform(0.1, 0.9))
        system.reals[0] = t
        dy, jacobian, dfdt = system.evaluate(t, y)
        typical = np.max(np.abs(jacobian) * system.scale, axis=1) + np.abs(dy) + 1e-9
        for k in range(n):
            error = min(
                float(
                    np.max(
                        np.abs(
                            _slope(lambda e, t=t, y=y, k=k: system.rhs(t, y + e * _unit(n, k)), h)
                            - jacobian[:, k]
                        )
                        * system.scale[k]
                        / typical
                    )
                )
                for h in (1e-4 * system.scale[k], 1e-5 * system.scale[k], 1e-6 * system.scale[k])
            )
            assert error < 1e-5, f"column {k}"
        error = min(
            float(
                np.max(
                    np.abs(_slope(lambda e, t=t, y=y: system.rhs(t + e, y), h) - dfdt)
                    / (np.abs(dfdt) + typical)
                )
            )
            for h in (1e-5, 1e-6, 1e-7)
        )
        assert error < 1e-5


def _slope(function: Any, h: float) -> Any:
    return (function(h) - function(-h)) / (2 * h)


def _unit(n: int, k: int) -> Any:
    unit = np.zeros(n)
    unit[k] = 1.0
    return unit
