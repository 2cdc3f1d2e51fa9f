"""What holds for every effect, found by discovery: a new file in the catalogue is tested here at once."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from harness import SMOOTH_ROWS, Model
from hypothesis import given, settings
from hypothesis import strategies as st

import hdsim.kernel as k
from hdsim.effects import catalogue
from hdsim.effects.__main__ import page
from hdsim.effects._fitting import range_of, scales_of
from hdsim.effects.base_flexibility import BaseFlexibility
from hdsim.effects.input_coulomb_viscous import InputCoulombViscous
from hdsim.effects.kinematic_error import ErrorComponent, KinematicError
from hdsim.effects.load_dependent_kinematic_error import LoadDependentKinematicError, StiffnessComponent
from hdsim.effects.load_dependent_loss import LoadDependentLoss
from hdsim.effects.lugre_friction import LugreFriction
from hdsim.effects.motor_torque_ripple import MotorTorqueRipple, RippleComponent
from hdsim.effects.position_dependent_friction import FrictionComponent, PositionDependentFriction
from hdsim.effects.thermal_friction import ThermalFriction
from hdsim.effects.thermal_stiffness import ThermalStiffness
from hdsim.effects.torsional_hysteresis_maxwell import SlipElement, TorsionalHysteresisMaxwell
from hdsim.effects.unbalance import Unbalance
from hdsim.effects.wave_generator_bearing import BearingComponent, WaveGeneratorBearing
from hdsim.parts import Effect

COORDINATES = {
    "time",
    "wave_generator_angle",
    "output_angle",
    "velocity",
    "direction",
    "time_since_reversal",
    "torque",
    "temperature",
    "frequency",
}
CHANNELS = {
    "motor_angle",
    "motor_velocity",
    "motor_torque",
    "output_angle",
    "output_velocity",
    "output_torque",
    "load_torque",
    "temperature",
}
#: Size of each input in operation, and its smallest interesting size: random magnitudes lie in between.
SIZES = {
    k.MOTOR_ANGLE: (0.1, 300.0),
    k.MOTOR_VELOCITY: (1e-3, 400.0),
    k.RING_ANGLE: (0.01, 3.0),
    k.RING_VELOCITY: (1e-5, 4.0),
    k.OUTPUT_ANGLE: (0.01, 3.0),
    k.OUTPUT_VELOCITY: (1e-5, 4.0),
    k.TRANSMITTED_TORQUE: (0.01, 100.0),
    k.TWIST: (1e-6, 3e-3),
    k.TWIST_RATE: (1e-6, 1.0),
    k.MESH_TWIST: (1e-6, 3e-3),
    k.MESH_TWIST_RATE: (1e-6, 1.0),
    k.TIME: (0.1, 100.0),
}
#: Angle or twist column of each port, by the row of its torque.
PORTS = {row: 2 * row for row in (k.MOTOR_TORQUE, k.RING_TORQUE, k.OUTPUT_TORQUE)}
PORTS |= {k.TWIST_TORQUE: k.TWIST, k.MESH_TORQUE: k.MESH_TWIST}

#: Every effect with its default numbers, and settings that reach what the defaults leave unused.
EFFECTS: dict[str, tuple[Effect, ...]] = {name: (kind(),) for name, kind in catalogue().items()} | {
    "kinematic_error, phases": (
        KinematicError(
            components=(
                ErrorComponent(order=2.5, amplitude_rad=1e-4, phase_deg=40, per="relative_turn"),
                ErrorComponent(order=3, amplitude_arcmin=0.3, phase_deg=-70, per="output_turn"),
            )
        ),
    ),
    "lugre_friction, heavy damping": (
        LugreFriction(damping_nm_s_per_rad=0.3, viscous_nm_s_per_rad=1e-3, static_nm=0.09, coulomb_nm=0.03),
    ),
    "thermal_friction, Coulomb": (
        ThermalFriction(coulomb_nm=0.03, viscous_nm_s_per_rad=1e-3),
        InputCoulombViscous(coulomb_nm=0.03),  # the friction that it changes
    ),
    "thermal_stiffness, warming": (ThermalStiffness(), ThermalFriction()),
    "wave_generator_bearing, cage": (
        WaveGeneratorBearing(
            components=(
                BearingComponent(at="cage", harmonic=2, friction_nm=0.01, error_arcmin=0.2, phase_deg=40),
                BearingComponent(at="ball_spin", friction_nm=0.02),
            )
        ),
    ),
    "maxwell, given elements": (
        TorsionalHysteresisMaxwell(
            elements=(SlipElement(stiffness_nm_per_rad=4000, slip_torque_nm=0.7),), sharpness=3
        ),
    ),
    "motor_torque_ripple, phases": (
        MotorTorqueRipple(components=(RippleComponent(order=7, cogging_nm=0.01, share=0.1, phase_deg=30),)),
        InputCoulombViscous(coulomb_nm=0.03),  # what the windings give without a load
    ),
    "load_dependent_kinematic_error, phases": (
        LoadDependentKinematicError(
            components=(
                StiffnessComponent(order=2.5, stiffness_nm_per_rad=700, phase_deg=40, per="relative_turn"),
                StiffnessComponent(order=3, stiffness_nm_per_rad=300, phase_deg=-70, per="output_turn"),
            )
        ),
    ),
    "position_dependent_friction, phases": (
        PositionDependentFriction(
            components=(
                FrictionComponent(order=2.5, amplitude_nm=0.01, phase_deg=40, per="relative_turn"),
                FrictionComponent(order=3, amplitude_nm=0.02, phase_deg=-70, per="output_turn"),
            )
        ),
    ),
    "base_flexibility, housing": (BaseFlexibility(stiffness_nm_per_rad=3e5, natural_frequency_hz=70),),
    "load_dependent_loss, by direction": (LoadDependentLoss(coefficient=0.2, back_driving_coefficient=0.05),),
    "unbalance, both": (Unbalance(motor_kg_m=1e-4, motor_phase_deg=20, output_phase_deg=-50),),
}
MODELS: dict[str, Model] = {}


def model(name: str) -> Model:
    if name not in MODELS:
        MODELS[name] = Model(*EFFECTS[name], base=2e-3)
    return MODELS[name]


@st.composite
def random_inputs(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    """Signed magnitudes, uniform in their logarithm: 12 inputs, and 6 own states in units of their scale."""
    unit = st.floats(0.0, 1.0)
    values = []
    for low, high in SIZES.values():
        size = low * (high / low) ** draw(unit)
        values.append(size if draw(st.booleans()) else -size)
    # Not at 1, where a slip element's law has a corner in its second derivative.
    own = [draw(st.floats(0.02, 0.97)) * (1 if draw(st.booleans()) else -1) for _ in range(6)]
    return values, own


def placed(model: Model, drawn: tuple[list[float], list[float]]) -> np.ndarray:
    inputs = model.initial
    inputs[: k.OWN] = drawn[0]
    scales = np.array([state.scale for state in model.builder.states])
    inputs[k.OWN :] += scales * np.array(drawn[1][: len(scales)])
    return inputs


def differences(model: Model, inputs: np.ndarray) -> np.ndarray:
    """d outputs / d inputs by fourth-order central differences, shape (columns, columns)."""
    columns = []
    for column in range(model.columns):
        lowest = SIZES[column][0] if column in SIZES else model.builder.states[column - k.OWN].scale
        step = 2e-4 * max(lowest, abs(inputs[column]))
        if column in (k.MOTOR_ANGLE, k.OUTPUT_ANGLE, k.RING_ANGLE):
            step = 1e-5
        total = np.zeros(model.columns)
        for weight, shift in ((8, 1), (-8, -1), (-1, 2), (1, -2)):
            moved = inputs.copy()
            moved[column] += shift * step
            total += weight * model(moved)[0]
        columns.append(total / (12 * step))
    return np.array(columns).T


# A table's second derivative jumps at its corners, which a difference quotient may straddle.
@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "table"])
@settings(max_examples=60, deadline=None)
@given(drawn=random_inputs())
def test_jacobian_equals_finite_differences(name: str, drawn: tuple[list[float], list[float]]) -> None:
    m = model(name)
    inputs = placed(m, drawn)
    outputs, exact = m(inputs)
    numeric = differences(m, inputs)
    for row in [*SMOOTH_ROWS, *range(k.OWN, m.columns)]:
        # A derivative counts as far as it moves the output when its input changes by its own size.
        sizes = np.abs(inputs) + 1e-12
        scale = np.max(np.abs(numeric[row]) * sizes) + abs(outputs[row])
        assert np.abs((exact[row] - numeric[row]) * sizes).max() <= 1e-6 * scale + 1e-13, f"row {row}"


@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=60, deadline=None)
@given(drawn=random_inputs())
def test_power_in_equals_heat_and_stored_and_exchanged_power(
    name: str, drawn: tuple[list[float], list[float]]
) -> None:
    m = model(name)
    inputs = placed(m, drawn)
    outputs, _ = m(inputs)
    stored = differences(m, inputs)[k.STORED]
    rates = np.zeros(m.columns)
    rates[list(PORTS.values())] = inputs[[c + 1 for c in PORTS.values()]]
    rates[k.TIME] = 1.0
    rates[k.OWN :] = outputs[k.OWN :]
    taken = sum(outputs[row] * inputs[column + 1] for row, column in PORTS.items())
    balance = [
        taken,
        outputs[k.DISSIPATED],
        stored @ rates,
        -outputs[k.SUPPLIED],
        outputs[k.DELIVERED],
    ]
    size = np.abs(balance).max() + np.abs(stored * rates).max()
    assert abs(sum(balance)) <= 1e-7 * size + 1e-14
    # Stored energy is a function of positions and own states only: its rate could not be balanced otherwise.
    others = [k.MOTOR_VELOCITY, k.RING_VELOCITY, k.OUTPUT_VELOCITY, k.TRANSMITTED_TORQUE]
    others += [k.TWIST_RATE, k.MESH_TWIST_RATE]
    assert not stored[others].any()


@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=60, deadline=None)
@given(drawn=random_inputs())
def test_heat_is_never_negative(name: str, drawn: tuple[list[float], list[float]]) -> None:
    m = model(name)
    inputs = placed(m, drawn)
    heat = m(inputs)[0][k.DISSIPATED]
    assert heat >= 0
    if not m.builder.last:  # a thermal effect lowers the base friction's heat, every other effect adds to it
        assert heat >= 2e-3 * inputs[k.MOTOR_VELOCITY] ** 2 * (1 - 1e-12)


@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=60, deadline=None)
@given(motor=st.floats(-300, 300), output=st.floats(-3, 3))
def test_twist_derivatives_equal_finite_differences(name: str, motor: float, output: float) -> None:
    m = model(name)
    step = 1e-4
    value = m.error(motor, output)
    by_motor = (m.error(motor + step, output) - m.error(motor - step, output)) / (2 * step)
    by_output = (m.error(motor, output + step) - m.error(motor, output - step)) / (2 * step)
    numeric = np.array([by_motor[0], by_output[0], by_motor[1], by_motor[2], by_output[2]])
    assert np.allclose(numeric, value[1:], rtol=1e-5, atol=1e-8)
    assert by_output[1] == pytest.approx(value[4], rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("name", EFFECTS)
def test_series_compliances_are_odd_and_rise(name: str) -> None:
    torque = np.linspace(-300, 300, 601)
    for wind_up in model(name).builder.compliances:
        angle = wind_up(torque)
        assert angle.shape == torque.shape
        assert np.all(np.diff(angle) > 0)
        assert np.allclose(angle, -angle[::-1], atol=1e-18)


@pytest.mark.parametrize("name", catalogue())
def test_effect_does_something_or_says_what_it_needs(name: str) -> None:
    build = model(name).builder
    acts = len(build.first) > 1 or build.last or build.twists or build.compliances or build.half_gap
    assert acts or name == "sensors"  # sensors stand only where one is named


@pytest.mark.parametrize(("name", "kind"), catalogue().items())
def test_catalogue_entry_is_complete(name: str, kind: type) -> None:
    s = kind.signature
    assert kind.title
    assert kind.source
    assert kind.__module__.endswith("." + name)
    assert s.lives_in
    assert set(s.lives_in) <= COORDINATES
    assert s.channels
    assert set(s.channels) <= CHANNELS
    assert set(s.confused_with) <= set(catalogue()) - {name}
    properties = kind.model_json_schema()["properties"]
    assert all(field.get("description") for field in properties.values())


FITTED = [
    (name, path)
    for name, kind in catalogue().items()
    for path in dict.fromkeys(path for fitting in getattr(kind, "fittings", ()) for path in fitting.paths)
]
#: Angles at which something begins: periodic, so any number is one.
PERIODIC = ("phase_deg", "position_deg")


@pytest.mark.parametrize(("name", "path"), FITTED)
def test_every_fitted_field_says_what_it_can_be(name: str, path: str) -> None:
    found = range_of(catalogue()[name], path)
    if path.endswith(PERIODIC):
        return
    assert math.isfinite(found.most) or found.plausible is not None
    assert math.isfinite(found.least), "a size has a least value"
    if found.plausible is not None:
        assert 0 < found.plausible.low < found.plausible.high
        assert found.plausible.source
        if not found.plausible.of:
            assert found.plausible.high <= found.most
            assert found.least < found.plausible.high


@pytest.mark.parametrize(("name", "path"), FITTED)
def test_the_default_is_where_its_number_usually_is(name: str, path: str) -> None:
    """With the drive of the defaults, size 20 at ratio 100."""
    plausible = range_of(catalogue()[name], path).plausible
    here: object = catalogue()[name]()
    for key in path.split("."):
        if isinstance(here, tuple):
            here = here[int(key)] if int(key) < len(here) else None
        else:
            here = getattr(here, key, None)
    if plausible is None or not isinstance(here, float) or here == 0:
        return
    low, high = plausible.times(scales_of(52.0, -100.0, 1.6e4))
    assert low <= abs(here) <= high


def test_own_states_have_unique_names() -> None:
    names = [s.name for effect in catalogue() for s in model(effect).builder.states]
    assert len(names) == len(set(names))


def test_docs_page_is_current() -> None:
    text = (Path(__file__).parents[2] / "docs" / "effects.md").read_text(encoding="utf-8")
    assert text == page(), "run: python -m hdsim.effects > docs/effects.md"


def test_catalogue_imports_nothing_heavy() -> None:
    code = (
        "import sys; from hdsim.effects import catalogue; [kind() for kind in catalogue().values()]; "
        "print([m for m in ('numba', 'scipy', 'numpy', 'control', 'matplotlib') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
