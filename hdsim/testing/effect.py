"""What holds for every effect, at states that a caller draws, and ``check_effect``, which draws them."""

from __future__ import annotations

import inspect
import math
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

import hdsim.kernel as k
from hdsim._abi import SIGNATURES
from hdsim.log.mapping import MEASURED
from hdsim.parts import Effect
from hdsim.scenario.fields import UNITS, split_unit
from hdsim.scenario.schema import json_schema
from hdsim.scenario.validation import load_model
from hdsim.scenario.writer import to_yaml
from hdsim.testing.alone import SMOOTH_ROWS, Alone, Collector

Array = NDArray[np.float64]

#: Coordinates that a signature may name.
COORDINATES = frozenset(
    {
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
)
#: Smallest interesting size of each input, and its size in operation.
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
#: Friction that the drive has of its own while an effect is checked, N m s/rad.
BASE = 2e-3


def check_effect(
    kind: type[Effect], *, name: str = "", states: int = 60, seed: int = 0, **parameters: Any
) -> None:
    """Hold an effect to everything that solvers, audit, files and editors rely on.

    Exact derivatives against differences of fourth order, the balance of power, heat that is never negative,
    the kernels' signatures, names and units, the way through a YAML file, the schema.

    Args:
        kind: the effect.
        name: its name in scenarios, for the messages; the class name when empty.
        states: random states at which its kernels are tried.
        seed: of the states.
        parameters: its numbers, where the defaults leave a part of it unused.

    Raises:
        AssertionError: something does not hold; the message says what, and where.
        pydantic.ValidationError: the parameters are none of this effect.
    """
    name = name or kind.__name__
    check_class(kind, name)
    effect = kind.model_validate(parameters)
    check_files(effect, name)
    collected = Collector()
    effect.contribute(collected)
    check_signatures(collected, name)
    alone = Alone(effect, base=BASE)
    check_compliances(alone, name)
    rng = np.random.default_rng(seed)
    for _ in range(states):
        sizes = [
            low * (high / low) ** rng.uniform() * rng.choice([-1.0, 1.0]) for low, high in SIZES.values()
        ]
        own = rng.uniform(0.02, 0.97, 6) * rng.choice([-1.0, 1.0], 6)
        inputs = placed(alone, sizes, own.tolist())
        check_jacobian(alone, inputs, name)
        check_power(alone, inputs, name)
        check_heat(alone, inputs, name)
        check_twist(alone, rng.uniform(-300, 300), rng.uniform(-3, 3), name)


def placed(alone: Alone, sizes: list[float], own: list[float]) -> Array:
    """Inputs (columns,) of 12 given sizes and of own states in units of their scales."""
    inputs = alone.initial
    inputs[: k.OWN] = sizes
    scales = np.array([state.scale for state in alone.builder.states])
    inputs[k.OWN :] += scales * np.array(own[: len(scales)])
    return inputs


def differences(alone: Alone, inputs: Array) -> Array:
    """Derivative d outputs / d inputs by central differences of fourth order, shape (columns, columns)."""
    columns = []
    for column in range(alone.columns):
        lowest = SIZES[column][0] if column in SIZES else alone.builder.states[column - k.OWN].scale
        step = 2e-4 * max(lowest, abs(inputs[column]))
        if column in (k.MOTOR_ANGLE, k.OUTPUT_ANGLE, k.RING_ANGLE):
            step = 1e-5
        total = np.zeros(alone.columns)
        for weight, shift in ((8, 1), (-8, -1), (-1, 2), (1, -2)):
            moved = inputs.copy()
            moved[column] += shift * step
            total += weight * alone(moved)[0]
        columns.append(total / (12 * step))
    return np.array(columns).T


def check_jacobian(alone: Alone, inputs: Array, name: str) -> None:
    """The kernels' derivatives are those of their outputs."""
    outputs, exact = alone(inputs)
    numeric = differences(alone, inputs)
    for row in [*SMOOTH_ROWS, *range(k.OWN, alone.columns)]:
        # A derivative counts as far as it moves the output when its input changes by its own size.
        sizes = np.abs(inputs) + 1e-12
        scale = np.max(np.abs(numeric[row]) * sizes) + abs(outputs[row])
        off = np.abs((exact[row] - numeric[row]) * sizes)
        worst = int(np.argmax(off))
        assert off[worst] <= 1e-6 * scale + 1e-13, (
            f"{name}: d outputs[{row}] / d inputs[{worst}] is {exact[row, worst]:.9g}, differences give "
            f"{numeric[row, worst]:.9g}, at inputs {inputs.tolist()}"
        )


def check_power(alone: Alone, inputs: Array, name: str) -> None:
    """What flows in at the ports is stored, lost, supplied or delivered."""
    outputs, _ = alone(inputs)
    stored = differences(alone, inputs)[k.STORED]
    rates = np.zeros(alone.columns)
    rates[list(PORTS.values())] = inputs[[c + 1 for c in PORTS.values()]]
    rates[k.TIME] = 1.0
    rates[k.OWN :] = outputs[k.OWN :]
    taken = sum(outputs[row] * inputs[column + 1] for row, column in PORTS.items())
    balance = [taken, outputs[k.DISSIPATED], stored @ rates, -outputs[k.SUPPLIED], outputs[k.DELIVERED]]
    size = np.abs(balance).max() + np.abs(stored * rates).max()
    assert abs(sum(balance)) <= 1e-7 * size + 1e-14, (
        f"{name}: the powers do not balance: {sum(balance):.6g} W are left of {size:.6g} W, at inputs "
        f"{inputs.tolist()}"
    )
    others = [k.MOTOR_VELOCITY, k.RING_VELOCITY, k.OUTPUT_VELOCITY, k.TRANSMITTED_TORQUE]
    others += [k.TWIST_RATE, k.MESH_TWIST_RATE]
    # Its rate could not be balanced otherwise.
    assert not stored[others].any(), f"{name}: the stored energy depends on a speed or the transmitted torque"


def check_heat(alone: Alone, inputs: Array, name: str) -> None:
    """No account of heat gives any back, and one that lowers no other's friction adds to what there is."""
    for account, heat in alone.heats(inputs).items():
        assert heat >= 0, f"{name}: {account}: heat of {heat:.6g} W, at inputs {inputs.tolist()}"
    if not alone.builder.last:  # a thermal effect lowers the base friction's heat, others add to it
        heat = alone(inputs)[0][k.DISSIPATED]
        least = BASE * inputs[k.MOTOR_VELOCITY] ** 2 * (1 - 1e-12)
        assert heat >= least, f"{name}: takes heat from the drive's friction, at inputs {inputs.tolist()}"


def check_twist(alone: Alone, motor: float, output: float, name: str) -> None:
    """First and second derivatives of what is added to the mesh twist."""
    step = 1e-4
    value = alone.error(motor, output)
    by_motor = (alone.error(motor + step, output) - alone.error(motor - step, output)) / (2 * step)
    by_output = (alone.error(motor, output + step) - alone.error(motor, output - step)) / (2 * step)
    numeric = np.array([by_motor[0], by_output[0], by_motor[1], by_motor[2], by_output[2]])
    good = np.allclose(numeric, value[1:], rtol=1e-5, atol=1e-8)
    good &= math.isclose(by_output[1], value[4], rel_tol=1e-5, abs_tol=1e-8)
    assert good, (
        f"{name}: derivatives of the twist at {motor:.6g}, {output:.6g} rad: {value[1:]} is not {numeric}"
    )


def check_compliances(alone: Alone, name: str) -> None:
    """A spring in series winds up the more the more torque there is, in both directions alike."""
    torque = np.linspace(-300, 300, 601)
    for wind_up in alone.builder.compliances:
        angle = wind_up(torque)
        assert angle.shape == torque.shape, (
            f"{name}: a wind-up of shape {angle.shape} for torques {torque.shape}"
        )
        assert np.all(np.diff(angle) > 0), f"{name}: a wind-up that does not rise with the torque"
        assert np.allclose(angle, -angle[::-1], atol=1e-18), f"{name}: a wind-up that is not odd"


def check_signatures(build: Collector, name: str) -> None:
    """Every kernel takes what its contract says."""
    elements = [kernel for kernel, _, _ in (*build.first, *build.last)]
    for kernel in (*elements, *(kernel for kernel, _ in build.twists)):
        found, wanted = (
            len(inspect.signature(kernel.function).parameters),
            len(SIGNATURES[kernel.contract].args),
        )
        assert found == wanted, f"{name}: {kernel} takes {found} arguments, its contract has {wanted}"
    for state in build.states:
        assert state.scale > 0, f"{name}: state {state.name} has no scale"
        assert state.unit, f"{name}: state {state.name} has no unit"


def check_class(kind: type[Effect], name: str) -> None:
    """Title, source and signature are there; fields are told, with units in their names."""
    assert kind.title, f"{name}: no title"
    assert kind.source, f"{name}: no source"
    signature = kind.signature
    for what, named, known in (
        ("lives_in", signature.lives_in, COORDINATES),
        ("channels", signature.channels, frozenset(MEASURED)),
    ):
        assert named, f"{name}: signature.{what} is empty"
        assert set(named) <= known, (
            f"{name}: signature.{what}: {set(named) - known}; there are: {sorted(known)}"
        )
    for owner, field, description in _fields(kind):
        assert description, f"{name}: {owner}.{field} has no docstring"
        stated = re.search(r", ([^ ,.][^,.]*)\.$", description)
        if stated and stated[1] in UNITS.values():
            assert split_unit(field)[1], (
                f"{name}: {owner}.{field} is in {stated[1]}, which its name does not say"
            )


def _fields(kind: type[BaseModel]) -> Iterator[tuple[str, str, str]]:
    """Class, name and description of every field, of nested models too."""
    for name, field in kind.model_fields.items():
        yield kind.__name__, name, field.description or ""
        inside = [field.annotation]
        while inside:
            one = inside.pop()
            if isinstance(one, type) and issubclass(one, BaseModel):
                yield from _fields(one)
            else:
                inside += get_args(one)


def check_files(effect: Effect, name: str) -> None:
    """An effect comes back from a file as it was written, and editors have a schema of it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "effect.yaml"
        path.write_text(to_yaml(effect.model_dump(mode="json")), encoding="utf-8")
        back = load_model(path, type(effect))
    assert back == effect, f"{name}: {effect!r} comes back from a file as {back!r}"
    known = json_schema(type(effect))["$defs"][type(effect).__name__]["properties"]
    assert set(known) == set(type(effect).model_fields), f"{name}: its schema has the fields {sorted(known)}"
