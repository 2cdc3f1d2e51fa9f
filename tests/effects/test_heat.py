"""No friction gives energy back: every effect over all of its legal numbers, and the audit of a run."""

from __future__ import annotations

import types
import typing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from annotated_types import Ge, Gt, Le, Lt
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

import hdsim.drive.model as drive_model
import hdsim.kernel as k
from hdsim.actuation.shapes import Ramp
from hdsim.actuation.signal_data import SignalData
from hdsim.actuation.waves import Sine
from hdsim.drive.friction import contribute_friction
from hdsim.drive.parameters import Drive, Friction
from hdsim.effects import catalogue
from hdsim.effects.input_coulomb_viscous import InputCoulombViscous
from hdsim.effects.thermal_friction import ThermalFriction
from hdsim.kernel import DISSIPATED, MOTOR_TORQUE, MOTOR_VELOCITY, element
from hdsim.log import verify_log
from hdsim.parts import Builder, Parameters, Part
from hdsim.simulation.run import Run
from hdsim.simulation.simulate import summary
from hdsim.testing.alone import Alone
from hdsim.testing.effect import SIZES

#: Size up to which a number without an upper bound is drawn, and down to which all are.
LARGEST, SMALLEST = 1e6, 1e-9


def drawn(info: Any, annotation: Any, rng: np.random.Generator) -> Any:
    """A value that a field allows; numbers log-uniform above their lower bound, or at a bound."""
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        return drawn(info, typing.get_args(annotation)[0], rng)
    if origin in (types.UnionType, typing.Union):
        return drawn(info, rng.choice(np.array(typing.get_args(annotation), dtype=object)), rng)
    if annotation is type(None):
        return None
    if origin is typing.Literal:
        return str(rng.choice(typing.get_args(annotation)))
    if origin is tuple:
        item = typing.get_args(annotation)[0]
        return [drawn(None, item, rng) for _ in range(int(rng.integers(1, 4)))]
    if isinstance(annotation, type) and issubclass(annotation, Parameters):
        return {name: drawn(field, field.annotation, rng) for name, field in annotation.model_fields.items()}
    assert annotation in (float, int), annotation
    low, high = None, LARGEST
    for bound in getattr(info, "metadata", ()):
        if isinstance(bound, Ge | Gt):
            low = float(getattr(bound, "ge", getattr(bound, "gt", 0.0)))
        if isinstance(bound, Le | Lt):
            high = float(getattr(bound, "le", getattr(bound, "lt", high)))
    if annotation is int:
        return int(rng.integers(int(low or 0), min(int(high), 64) + 1))
    size = float(np.exp(rng.uniform(np.log(SMALLEST), np.log(high - (low or 0.0)))))
    if low is None:
        return float(rng.choice([-1.0, 1.0])) * size
    return float(rng.choice([low, high, low + size, low + size, low + size, low + size]))


def anything(kind: type[Parameters], rng: np.random.Generator) -> Any:
    """Parameters with any legal numbers."""
    for _ in range(200):
        try:
            return kind.model_validate(drawn(None, kind, rng))
        except ValidationError:
            continue
    raise AssertionError(f"no legal {kind.__name__} among 200")


class DriveFriction(Part):
    """The drive's own friction."""

    friction: Friction

    def contribute(self, build: Builder) -> None:
        contribute_friction(build, self.friction)


def states_of(rng: np.random.Generator, model: Alone) -> np.ndarray:
    """Inputs in operation, own states within their scales."""
    inputs = model.initial
    for column, (low, high) in SIZES.items():
        inputs[column] = rng.choice([-1.0, 1.0]) * low * (high / low) ** rng.uniform()
    scales = np.array([state.scale for state in model.builder.states])
    inputs[k.OWN :] += scales * rng.uniform(-1.0, 1.0, len(scales))
    return inputs


# A table is what was measured: where it drives it supplies. Sensors have no power.
@pytest.mark.parametrize("name", [name for name in catalogue() if name not in ("table", "sensors")])
@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_legal_numbers_let_an_effect_give_energy_back(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    effect, own = anything(catalogue()[name], rng), anything(Friction, rng)
    model = Alone(DriveFriction(friction=own), InputCoulombViscous(coulomb_nm=0.02), effect)
    inputs = states_of(rng, model)
    heats = model.heats(inputs)
    # What cancels in a sum of heats leaves its rounding.
    assert min(heats.values()) >= -1e-12 * model.powers(inputs), effect


COMBINED = [name for name in catalogue() if name not in ("table", "sensors")]


@pytest.mark.parametrize("block", range(10))
def test_no_legal_combination_of_effects_gives_energy_back(block: int) -> None:
    """1,000 draws: two to six effects with any legal numbers, in any state, over any legal friction."""
    rng = np.random.default_rng([15, block])
    for _ in range(100):
        names = rng.choice(COMBINED, int(rng.integers(2, 7)), replace=False)
        effects = {str(name): anything(catalogue()[str(name)], rng) for name in names}
        model = Alone(DriveFriction(friction=anything(Friction, rng)), *effects.values())
        for _ in range(5):
            inputs = states_of(rng, model)
            heats = model.heats(inputs)
            assert min(heats.values()) >= -1e-12 * model.powers(inputs), effects


def test_thermal_friction_changes_as_much_as_the_shaft_has_however_much_is_asked() -> None:
    # The numbers with which a free motor ran away.
    asked = ThermalFriction(viscous_nm_s_per_rad=8e-4, coulomb_nm=5.0, ambient_degc=60)
    own = Friction(coulomb_nm=0.03, viscous_nm_s_per_rad=3.5e-4, load_coefficient=0.0)
    model = Alone(DriveFriction(friction=own), asked)
    inputs = model.initial
    inputs[k.MOTOR_VELOCITY] = 200.0
    expected = 3.5e-4 * np.exp(-0.033 * 40) * 200.0 + 0.03 * np.exp(-0.01 * 40)
    assert model(inputs)[0][k.INPUT_FRICTION] == pytest.approx(expected, rel=1e-9)


def free_motor(*parts: Part, **options: Any) -> Run:
    model = drive_model.Model(
        Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": "lumped"}}),
        parts,
        load_inertia_kg_m2=0.1,
        **options,
    )
    return Run(
        model,
        duration_s=3.0,
        sample_rate_hz=500.0,
        y0=model.initial_state(motor_velocity=200.0),
    )


def test_a_free_motor_slows_down_whatever_its_friction_is_said_to_be() -> None:
    run = free_motor(ThermalFriction(viscous_nm_s_per_rad=8e-4, ambient_degc=60))
    found = run.record()
    assert abs(found["motor_velocity"][-1]) < 200.0
    assert np.all(np.diff(found["heat"]) >= -1e-9 * found["heat"][-1])
    assert run.audit.given_back <= 1e-12 * run.audit.exchanged
    assert run.audit.relative < 1e-6


@element
def pushing(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """A friction of the wrong sign whose books are in order. Parameter: b."""
    speed = inputs[MOTOR_VELOCITY]
    outputs[MOTOR_TORQUE] += parameters[0] * speed
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] += parameters[0]
    outputs[DISSIPATED] -= parameters[0] * speed * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] -= 2.0 * parameters[0] * speed


class Pushing(Part):
    """Gives energy back, less than the drive's own friction takes."""

    def contribute(self, build: Builder) -> None:
        build.element(pushing, [1e-4])


def test_the_audit_refuses_heat_below_zero_though_the_balance_closes_and_other_parts_hide_it() -> None:
    run = free_motor(Pushing())
    found = run.record()
    assert np.all(np.diff(found["heat"]) >= -1e-9 * found["heat"][-1])  # all parts together
    assert run.audit.residual < 1e-6 * run.audit.exchanged
    given = np.trapezoid(1e-4 * found["motor_velocity"] ** 2, found.time)
    assert run.audit.given_back == pytest.approx(given, rel=1e-2)
    assert run.audit.relative > 0.1
    told = [event for event in run.events if event.level == "error"]
    assert len(told) == 1
    assert "pushing" in told[0].message


@pytest.mark.parametrize("parts", [(), (Pushing(),)], ids=["sound", "pushing"])
def test_verify_refuses_a_log_with_energy_from_nothing(parts: tuple[Part, ...], tmp_path: Path) -> None:
    run = free_motor(*parts)
    recording = run.record()
    recording.metadata.update(summary(run, 0.0))
    recording.save(tmp_path / "run.mcap")
    problems = verify_log(tmp_path / "run.mcap").problems
    assert [problem for problem in problems if "energy from nothing" in problem and "pushing" in problem] == (
        problems if parts else []
    )
    assert bool(problems) == bool(parts), problems


@pytest.mark.parametrize("mesh", ["rigid", "lumped"])
def test_friction_follows_a_measured_temperature(mesh: str) -> None:
    # At a constant speed the friction is b exp(-beta (T - 20)) w plus what does not change.
    drive = Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": mesh}})
    temperature = SignalData(Sine(amplitude=12.0, offset=33.0, frequency_hz=0.4).move())
    motion = SignalData(Ramp(velocity=200.0).move())
    effect = ThermalFriction(viscosity_coefficient_per_k=0.04, coulomb_nm=1.0, heat_capacity_j_per_k=1e-3)
    model = drive_model.Model(
        drive,
        [effect],
        load_inertia_kg_m2=0.1,
        motions={"motor": motion},
        signals={"temperature": temperature},
    )
    assert model.states == ()
    run = Run(model, duration_s=3.0, sample_rate_hz=200.0)
    found = run.record()
    assert run.audit.relative < 1e-6
    above = 33.0 + 12.0 * np.sin(2 * np.pi * 0.4 * found.time) - 20.0
    friction = drive.friction
    expected = friction.viscous_nm_s_per_rad * np.exp(-0.04 * above) * 200.0
    expected += friction.coulomb_nm * np.exp(-0.01 * above)
    settled = found.time > 1.0
    np.testing.assert_allclose(
        found["input_friction_torque"][settled], expected[settled], rtol=2e-3 if mesh == "lumped" else 1e-9
    )
    # The exact derivatives over time, which the signal brings in.
    check_derivatives(model.system, 1.7)


def check_derivatives(system: Any, t: float) -> None:
    y = system.y0 + 0.1 * system.scale
    system.reals[0] = t
    _, _, by_time = system.evaluate(t, y)
    h = 1e-5
    numeric = (system.rhs(t + h, y) - system.rhs(t - h, y)) / (2 * h)
    np.testing.assert_allclose(by_time, numeric, rtol=1e-6, atol=1e-6 * np.max(np.abs(numeric)))


def test_a_measured_temperature_that_no_part_asks_for_costs_nothing() -> None:
    drive = Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": "rigid"}})
    offered = {"temperature": SignalData(Sine(amplitude=1.0, frequency_hz=1.0).move())}
    assert drive_model.Model(drive, [], load_inertia_kg_m2=0.1, signals=offered).signals == ()
