"""A housing that rings on its mount: closed forms, the energy audit, and the assembled derivatives."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.linalg import eigh, expm

from hdsim.actuation.shapes import Hold
from hdsim.actuation.signal_data import SignalData
from hdsim.actuation.waves import Sine
from hdsim.drive import _layout as layout
from hdsim.drive.model import COORDINATES, Model
from hdsim.drive.parameters import Drive
from hdsim.effects.base_flexibility import BaseFlexibility
from hdsim.effects.kinematic_error import KinematicError
from hdsim.effects.torsional_hysteresis_duhem import TorsionalHysteresisDuhem
from hdsim.errors import InputError
from hdsim.scenario import Scenario
from hdsim.simulation.linear import linearize
from hdsim.simulation.run import Run
from hdsim.simulation.setup import build_model

STIFFNESS, DAMPING, LOAD = 2.0e4, 15.0, 0.4  # of a linear spring, N m/rad, N m s/rad, kg m^2
LINEAR = {
    "preset": "csg-20-100",
    "mesh": {"model": "lumped"},
    "torsion": {
        "stiffness_k1_nm_per_rad": STIFFNESS,
        "stiffness_k2_nm_per_rad": STIFFNESS,
        "stiffness_k3_nm_per_rad": STIFFNESS,
        "damping_nm_s_per_rad": DAMPING,
    },
}
LOSSLESS = {
    "torsion": LINEAR["torsion"] | {"damping_nm_s_per_rad": 0.0},  # type: ignore[operator]
    "friction": {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0},
}
MOUNT = BaseFlexibility(stiffness_nm_per_rad=1.5e5, natural_frequency_hz=60.0, damping_ratio=0.08)


def locked_motor(effect: BaseFlexibility, **numbers: Any) -> tuple[Model, Run]:
    drive = Drive.model_validate(LINEAR | numbers)
    model = Model(drive, [effect], load_inertia_kg_m2=LOAD, motions={"motor": SignalData(Hold().move())})
    run = Run(
        model,
        duration_s=0.4,
        sample_rate_hz=2000.0,
        y0=model.initial_state(output_twist=5e-4),
        rtol=1e-10,
    )
    return model, run


def matrices(model: Model, effect: BaseFlexibility) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inertia, stiffness and damping over output and housing: twist = g b - theta_l, g = 1 - 1/i."""
    lever = np.array([-1.0, 1.0 - 1.0 / model.ratio])
    inertia = np.diag([model.inertias[2], effect.inertia_kg_m2])
    mount = np.diag([0.0, effect.stiffness_nm_per_rad])
    viscous = 2.0 * effect.damping_ratio * math.sqrt(effect.stiffness_nm_per_rad * effect.inertia_kg_m2)
    damping = DAMPING * np.outer(lever, lever) + np.diag([0.0, viscous])
    return inertia, STIFFNESS * np.outer(lever, lever) + mount, damping


@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
def test_output_and_housing_ring_as_two_coupled_oscillators(arrangement: str) -> None:
    model, run = locked_motor(MOUNT, arrangement=arrangement)
    found = run.record()
    M, K, D = matrices(model, MOUNT)
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ K, -inverse @ D]])
    step = expm(A / 2000.0)
    x, wanted = np.array([-5e-4, 0.0, 0.0, 0.0]), []
    for _ in found.time:
        wanted.append(x)
        x = step @ x
    output, housing = np.array(wanted)[:, 0], np.array(wanted)[:, 1]
    # The spring is a table: exact to its interpolation.
    np.testing.assert_allclose(found["output_angle"], output, atol=1e-6 * 5e-4)
    np.testing.assert_allclose(found["housing_angle"], housing, atol=1e-6 * 5e-4)
    assert np.ptp(housing) > 1e-5
    assert run.audit.relative < 1e-7


def test_the_coupled_modes_are_those_of_the_linearised_drive() -> None:
    effect = MOUNT.model_copy(update={"damping_ratio": 0.0})
    scenario = Scenario.model_validate(
        {
            "drive": LINEAR | LOSSLESS,
            "effects": {"base_flexibility": effect.model_dump(exclude_none=True)},
            "command": {"motor": {"type": "free"}},
            "load": {"inertia_kg_m2": LOAD},
            "run": {"duration_s": 1.0},
        }
    )
    model = build_model(scenario)
    lever = np.array([1.0 / model.ratio, -1.0, 1.0 - 1.0 / model.ratio])
    motor, _, output = model.inertias
    K = STIFFNESS * np.outer(lever, lever) + np.diag([0.0, 0.0, effect.stiffness_nm_per_rad])
    squares = eigh(K, np.diag([motor, output, effect.inertia_kg_m2]), eigvals_only=True)
    wanted = np.sqrt(squares[1:]) / (2 * np.pi)
    linear = linearize(scenario)
    found = np.abs(np.linalg.eigvals(linear.A).imag) / (2 * np.pi)
    found = np.unique(np.round(found[found > 1.0], 6))
    np.testing.assert_allclose(found, wanted, rtol=1e-3)


def test_far_below_its_resonance_the_housing_is_a_compliance() -> None:
    still = BaseFlexibility(stiffness_nm_per_rad=1.5e5)
    fast = still.model_copy(update={"natural_frequency_hz": 2000.0, "damping_ratio": 0.5})
    runs = [locked_motor(effect, **LOSSLESS)[1].record() for effect in (still, fast)]
    early = runs[0].time < 0.1
    # The start differs: there the housing is at rest, and then at once where the torque wants it.
    np.testing.assert_allclose(
        runs[1]["output_angle"][early] / np.ptp(runs[1]["output_angle"]),
        runs[0]["output_angle"][early] / np.ptp(runs[0]["output_angle"]),
        atol=1e-2,
    )


MESHES: dict[str, dict[str, Any]] = {
    "lumped": {"model": "lumped"},
    "teeth": {"engagement": {"kind": "clearance"}, "pitch_error_m": 1e-6},
    "static": {"engagement": {"kind": "clearance"}, "pitch_error_m": 1e-6, "ring": "static"},
    "rigid": {"model": "rigid"},
}


def moving(mesh: str, arrangement: str, *, prescribed: bool) -> Model:
    drive = Drive.model_validate(
        {
            "preset": "seed-2021",
            "arrangement": arrangement,
            "mesh": MESHES[mesh],
            "inertia": {"ring_kg_m2": 1e-3},
        }
    )
    motions = {"motor": SignalData(Sine(amplitude=20.0, frequency_hz=3.0).move())} if prescribed else {}
    effects = [MOUNT, KinematicError(), TorsionalHysteresisDuhem()]
    return Model(drive, effects, load_inertia_kg_m2=0.3, motions=motions)


@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
@pytest.mark.parametrize("mesh", MESHES)
def test_energy_balances_with_a_moving_housing(mesh: str, arrangement: str) -> None:
    model = moving(mesh, arrangement, prescribed=False)
    start = model.initial_state(motor_velocity=200.0, output_twist=0.0 if mesh == "rigid" else 4e-4)
    run = Run(model, duration_s=0.15, sample_rate_hz=2000.0, y0=start, rtol=1e-8)
    found = run.record()
    assert run.failure is None
    assert run.audit.relative < 1e-6
    assert (np.ptp(found["housing_angle"]) > 1e-6) == (mesh != "rigid")


@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
@pytest.mark.parametrize("prescribed", [False, True])
@pytest.mark.parametrize("mesh", MESHES)
def test_derivatives_with_a_moving_housing_are_exact(mesh: str, prescribed: bool, arrangement: str) -> None:
    system = moving(mesh, arrangement, prescribed=prescribed).system
    rng = np.random.default_rng(5)
    n = system.size
    for _ in range(3):
        y = system.y0 + 0.3 * system.scale * rng.normal(size=n)
        t = float(rng.uniform(0.1, 0.9))
        system.reals[0] = t
        dy, jacobian, by_time = system.evaluate(t, y)
        typical = np.max(np.abs(jacobian) * system.scale, axis=1) + np.abs(dy) + 1e-9
        for k in range(n):
            errors = []
            for size in (1e-4, 1e-5, 1e-6):
                step = np.zeros(n)
                step[k] = size * system.scale[k]
                numeric = (system.rhs(t, y + step) - system.rhs(t, y - step)) / (2 * step[k])
                errors.append(np.max(np.abs(numeric - jacobian[:, k]) * system.scale[k] / typical))
            assert min(errors) < 1e-5, f"column {k}"
        errors = [
            np.max(
                np.abs((system.rhs(t + h, y) - system.rhs(t - h, y)) / (2 * h) - by_time)
                / (np.abs(by_time) + typical)
            )
            for h in (1e-5, 1e-6, 1e-7)
        ]
        assert min(errors) < 1e-5


@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
@pytest.mark.parametrize("mesh", [mesh for mesh in MESHES if mesh != "rigid"])
def test_turning_everything_bends_the_mount_alone(mesh: str, arrangement: str) -> None:
    model = moving(mesh, arrangement, prescribed=False)
    system = model.system
    y = system.y0 + 0.3 * system.scale * np.random.default_rng(6).normal(size=system.size)
    _, jacobian, _ = system.evaluate(0.5, y)
    # All angles by the same: ring and output are states as deviations from the ideal gear.
    turned = np.zeros(system.size)
    for name, at in model.place_of.items():
        turned[at] = 1.0 - (0.0 if name == "motor" else system.reals[layout.LAMBDA + COORDINATES.index(name)])
    housing = [state.name for state in model.states].index("housing_angle")
    first = system.size - system.quadratures - len(model.states)
    turned[first + housing] = 1.0
    row = jacobian[first + housing + 1]
    assert MOUNT.inertia_kg_m2 is not None
    wanted = -MOUNT.stiffness_nm_per_rad / MOUNT.inertia_kg_m2
    assert row @ turned == pytest.approx(wanted, abs=1e-12 * np.max(np.abs(row)), rel=1e-10)


def test_a_housing_has_one_inertia_and_a_model_one_housing() -> None:
    with pytest.raises(ValidationError, match="not both"):
        BaseFlexibility(housing_inertia_kg_m2=0.1, natural_frequency_hz=50.0)
    given = BaseFlexibility(stiffness_nm_per_rad=1e5, housing_inertia_kg_m2=1e5 / (2 * math.pi * 40.0) ** 2)
    assert given.inertia_kg_m2 == pytest.approx(
        BaseFlexibility(stiffness_nm_per_rad=1e5, natural_frequency_hz=40.0).inertia_kg_m2
    )
    drive = Drive.model_validate(LINEAR)
    with pytest.raises(InputError, match="housing"):
        Model(drive, [given, given], load_inertia_kg_m2=0.1)
