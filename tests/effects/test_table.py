"""The tabulated curve against analytic effects, potentials and the energy account of whole runs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import hdsim.kernel as k
from hdsim.drive.model import Model
from hdsim.drive.parameters import Drive
from hdsim.effects.input_coulomb_viscous import InputCoulombViscous
from hdsim.effects.kinematic_error import ErrorComponent, KinematicError
from hdsim.effects.stiffness_nonlinearity import StiffnessNonlinearity
from hdsim.effects.table import Table, TableCurve
from hdsim.effects.unbalance import Unbalance
from hdsim.parts import Effect
from hdsim.simulation.run import Run
from hdsim.testing.alone import Alone


def table(coordinate: str, acts_on: str, at, values, **more) -> Table:
    name = "values_rad" if acts_on == "mesh_angle" else "values_nm"
    curve = {"coordinate": coordinate, "acts_on": acts_on, "at": list(at), name: list(values), **more}
    return Table.model_validate({"curves": [curve]})


def swing(effect: Effect | None, mesh: str = "lumped", seconds: float = 0.6) -> tuple[Run, object]:
    """A lossy drive with an arm's inertia, thrown by its initial speed and a step of load."""
    drive = Drive.model_validate({"preset": "seed-2021", "mesh": {"model": mesh}})
    model = Model(drive, [] if effect is None else [effect], load_inertia_kg_m2=0.3)
    run = Run(
        model, duration_s=seconds, sample_rate_hz=500, rtol=1e-9, y0=model.initial_state(motor_velocity=80.0)
    )
    return run, run.record()


SPEEDS = np.sort(
    np.concatenate([np.linspace(-5, 5, 201), np.linspace(-120, -6, 20), np.linspace(6, 120, 20)])
)
TWISTS = np.linspace(-1e-3, 1e-3, 81)
TURN = np.linspace(0, 2 * np.pi, 48, endpoint=False)


@pytest.mark.parametrize(
    ("curve", "analytic"),
    [
        (
            table("motor_velocity", "motor_torque", SPEEDS, -0.02 * np.tanh(SPEEDS / 0.5) - 1e-4 * SPEEDS),
            InputCoulombViscous(coulomb_nm=0.02, viscous_nm_s_per_rad=1e-4),
        ),
        (
            table("motor_angle", "motor_torque", [-1e3, 1e3], [-0.02, -0.02], times_direction=True),
            InputCoulombViscous(coulomb_nm=0.02, viscous_nm_s_per_rad=0.0),
        ),
        (
            table("twist", "twist_torque", TWISTS, -3e9 * TWISTS**3),
            StiffnessNonlinearity(cubic_nm_per_rad3=3e9),
        ),
        (
            table(
                "output_angle", "output_torque", TURN, -9.80665 * 0.8 * np.cos(TURN + 0.4), period=2 * np.pi
            ),
            Unbalance(output_kg_m=0.8, output_phase_deg=math.degrees(0.4)),
        ),
        (
            table("motor_angle", "mesh_angle", TURN, 1e-4 * np.sin(2 * TURN + 0.3), period=2 * np.pi),
            KinematicError(
                components=(ErrorComponent(order=2, amplitude_rad=1e-4, phase_deg=math.degrees(0.3)),)
            ),
        ),
    ],
    ids=["coulomb and viscous", "coulomb by direction", "cubic stiffness", "unbalance", "kinematic error"],
)
def test_a_table_of_an_effects_curve_is_that_effect(curve: Table, analytic: Effect) -> None:
    run, tabulated = swing(curve)
    reference, wanted = swing(analytic)
    _, without = swing(None)
    for channel in ("motor_velocity", "output_angle"):
        matters = np.abs(wanted[channel] - without[channel]).max()
        assert np.abs(tabulated[channel] - wanted[channel]).max() < 0.01 * matters, channel
    for energy in ("heat", "work_supplied"):
        assert tabulated[energy][-1] == pytest.approx(wanted[energy][-1], rel=2e-3, abs=1e-9)
    assert run.audit.relative < 1e-6
    assert reference.audit.relative < 1e-6


@pytest.mark.parametrize("mesh", ["lumped", "rigid"])
@pytest.mark.parametrize(
    "curve",
    [
        table("output_angle", "output_torque", [0.0, 0.1, 0.2, 0.3], [0.0, -3.0, 2.0, 0.0]),
        table("motor_angle", "motor_torque", [0.0, 1.0, 2.5], [0.03, -0.02, 0.0], period=4.0),
        table("transmitted_torque", "motor_torque", [-20, 0, 20], [0.05, 0.0, 0.05], times_direction=True),
        table("time", "output_torque", [0.0, 0.1, 0.3], [0.0, 5.0, -5.0]),
        table("motor_angle", "output_torque", [0.0, 10.0, 30.0], [0.0, 4.0, -1.0]),
        table("output_velocity", "motor_torque", [-1, 0, 1], [0.1, 0.0, 0.1]),
    ],
    ids=lambda table: f"{table.curves[0].coordinate} on {table.curves[0].acts_on}",
)
def test_the_energy_account_closes_for_every_kind_of_curve(curve: Table, mesh: str) -> None:
    run, recording = swing(curve, mesh)
    _, without = swing(None, mesh)
    assert run.audit.relative < 1e-6
    assert np.abs(recording["motor_velocity"] - without["motor_velocity"]).max() > 0.01
    assert np.all(np.diff(recording["heat"]) >= -1e-12)


def test_stored_energy_is_the_integral_of_the_torque_over_many_turns() -> None:
    model = Alone(table("motor_angle", "motor_torque", [0.2, 1.0, 2.5], [0.3, -0.2, 0.5], period=4.0))

    def outputs(angle: float) -> np.ndarray:
        inputs = model.initial
        inputs[k.MOTOR_ANGLE] = angle
        return model(inputs)[0]

    for low, high in ((-13.7, 22.1), (0.3, 0.9), (-2.0, -1.0)):
        corners = [c + 4.0 * turn for turn in range(-4, 7) for c in (0.2, 1.0, 2.5)]
        work, _ = quad(
            lambda a: outputs(a)[k.MOTOR_TORQUE],
            low,
            high,
            points=[c for c in corners if low < c < high],
            limit=200,
        )
        assert outputs(low)[k.STORED] - outputs(high)[k.STORED] == pytest.approx(work, rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.05, 3.0), st.floats(-5, 5)), min_size=2, max_size=9),
    st.booleans(),
    st.floats(-40, 40),
)
def test_the_curve_meets_its_corners_is_smooth_and_levels_off(
    steps: list[tuple[float, float]], periodic: bool, probe: float
) -> None:
    at = np.cumsum([width for width, _ in steps])
    values = [value for _, value in steps]
    periodic = periodic and len(at) > 2
    more = {"period": float(at[-1] - at[0] + 1.0)} if periodic else {}
    model = Alone(table("output_angle", "output_torque", at, values, **more))

    def torque(angle: float) -> float:
        inputs = model.initial
        inputs[k.OUTPUT_ANGLE] = angle
        return float(model(inputs)[0][k.OUTPUT_TORQUE])

    def slope(angle: float) -> float:
        inputs = model.initial
        inputs[k.OUTPUT_ANGLE] = angle
        return float(model(inputs)[1][k.OUTPUT_TORQUE, k.OUTPUT_ANGLE])

    assert [torque(a) for a in at] == pytest.approx(values, abs=1e-9)
    for a in at:
        assert slope(a - 1e-9) == pytest.approx(slope(a + 1e-9), abs=1e-4 * (1 + abs(slope(a))))
    if periodic:
        assert torque(probe) == pytest.approx(torque(probe + more["period"]), abs=1e-8)
    else:
        assert torque(-100.0) == torque(-90.0)
        assert torque(100.0) == torque(90.0)
        assert slope(100.0) == 0.0


def test_between_close_corners_the_curve_is_that_of_a_spline() -> None:
    at = np.linspace(-2, 2, 81)
    model = Alone(table("output_angle", "output_torque", at, np.sin(3 * at)))
    inputs = model.initial
    spline = CubicSpline(at, np.sin(3 * at))
    for angle in np.linspace(-1.9, 1.9, 57):
        inputs[k.OUTPUT_ANGLE] = angle
        assert model(inputs)[0][k.OUTPUT_TORQUE] == pytest.approx(spline(angle), abs=2e-4)


def test_a_torque_that_brakes_is_heat_and_one_that_drives_is_supplied() -> None:
    model = Alone(table("motor_velocity", "motor_torque", [-10, 0, 10], [-0.1, 0.0, -0.1]))
    inputs = model.initial
    for speed, heat, supplied in ((10.0, 1.0, 0.0), (-10.0, 0.0, 1.0)):
        inputs[k.MOTOR_VELOCITY] = speed
        outputs = model(inputs)[0]
        assert outputs[k.DISSIPATED] == pytest.approx(heat)
        assert outputs[k.SUPPLIED] == pytest.approx(supplied)


def test_a_later_start_delays_only_curves_over_time() -> None:
    both = Table(
        curves=(
            TableCurve(coordinate="time", acts_on="motor_torque", at=(0, 1), values_nm=(0, 1)),
            TableCurve(coordinate="twist", acts_on="twist_torque", at=(0, 1), values_nm=(0, 1)),
        )
    )
    assert [curve.at for curve in both.delayed(0.5).curves] == [(0.5, 1.5), (0, 1)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"acts_on": "mesh_angle"}, "mesh_angle takes values_rad"),
        ({"values_rad": [0, 1, 2]}, "takes values_nm, and no values_rad"),
        ({"at": [0, 1]}, "3 numbers, at has 2"),
        ({"at": [0, 1, 1]}, "must increase"),
        ({"period": 2.0}, "within one period"),
        ({"coordinate": "time", "period": 9.0}, "a period is for"),
        (
            {"acts_on": "mesh_angle", "values_nm": None, "values_rad": [0, 1, 2], "coordinate": "twist"},
            "function of",
        ),
        (
            {"acts_on": "mesh_angle", "values_nm": None, "values_rad": [0, 1, 2], "times_direction": True},
            "torques",
        ),
    ],
)
def test_inconsistent_curves_are_refused_with_the_reason(change: dict, message: str) -> None:
    good = {"coordinate": "output_angle", "acts_on": "output_torque", "at": [0, 1, 2], "values_nm": [0, 1, 2]}
    TableCurve.model_validate(good)
    with pytest.raises(ValidationError, match=message):
        TableCurve.model_validate(good | change)
