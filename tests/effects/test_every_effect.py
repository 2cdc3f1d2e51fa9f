"""What holds for every effect, found by discovery: a new file in the catalogue is tested here at once."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
from hdsim.effects.torsional_hysteresis_duhem import TorsionalHysteresisDuhem
from hdsim.effects.torsional_hysteresis_maxwell import SlipElement, TorsionalHysteresisMaxwell
from hdsim.effects.unbalance import Unbalance
from hdsim.effects.wave_generator_bearing import BearingComponent, WaveGeneratorBearing
from hdsim.parts import Effect
from hdsim.testing.alone import Alone
from hdsim.testing.effect import (
    BASE,
    SIZES,
    check_class,
    check_compliances,
    check_files,
    check_heat,
    check_jacobian,
    check_power,
    check_signatures,
    check_twist,
    placed,
)

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
    "duhem, exponent": (TorsionalHysteresisDuhem(exponent=2.3),),
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
MODELS: dict[str, Alone] = {}


def model(name: str) -> Alone:
    if name not in MODELS:
        MODELS[name] = Alone(*EFFECTS[name], base=BASE)
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


# A table's second derivative jumps at its corners, which a difference quotient may straddle.
@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "table"])
@settings(max_examples=60, deadline=None)
@given(drawn=random_inputs())
def test_jacobian_equals_finite_differences(name: str, drawn: tuple[list[float], list[float]]) -> None:
    check_jacobian(model(name), placed(model(name), *drawn), name)


@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=60, deadline=None)
@given(drawn=random_inputs())
def test_power_in_equals_heat_and_stored_and_exchanged_power(
    name: str, drawn: tuple[list[float], list[float]]
) -> None:
    check_power(model(name), placed(model(name), *drawn), name)


@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=60, deadline=None)
@given(drawn=random_inputs())
def test_heat_is_never_negative(name: str, drawn: tuple[list[float], list[float]]) -> None:
    check_heat(model(name), placed(model(name), *drawn), name)


@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=60, deadline=None)
@given(motor=st.floats(-300, 300), output=st.floats(-3, 3))
def test_twist_derivatives_equal_finite_differences(name: str, motor: float, output: float) -> None:
    check_twist(model(name), motor, output, name)


@pytest.mark.parametrize("name", EFFECTS)
def test_kernels_compliances_and_files_are_as_they_should_be(name: str) -> None:
    check_signatures(model(name).builder, name)
    check_compliances(model(name), name)
    for effect in EFFECTS[name]:
        check_files(effect, name)


@pytest.mark.parametrize("name", catalogue())
def test_effect_does_something_or_says_what_it_needs(name: str) -> None:
    build = model(name).builder
    acts = len(build.first) > 1 or build.last or build.twists or build.compliances or build.half_gap
    acts = acts or build.odd_teeth or build.gap_growth
    assert acts or name == "sensors"  # sensors stand only where one is named


@pytest.mark.parametrize(("name", "kind"), catalogue().items())
def test_catalogue_entry_is_complete(name: str, kind: type[Effect]) -> None:
    check_class(kind, name)
    assert kind.__module__.endswith("." + name)
    assert set(kind.signature.confused_with) <= set(catalogue()) - {name}


FITTED = [
    (name, path)
    for name, kind in catalogue().items()
    for path in dict.fromkeys(path for fitting in getattr(kind, "fittings", ()) for path in fitting.paths)
]
#: Angles at which something begins: periodic, so any number is one.
PERIODIC = ("phase_deg", "position_deg", "tooth")


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
