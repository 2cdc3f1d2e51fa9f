"""How the channels of a run change with numbers of its scenario: derivatives, integrated beside the run.

For a number p of the scenario the model is built once more with p (1 + STEP), and its difference from the
run's own model is integrated by the variational equation along the steps of the run
(``hdsim.simulation._beside``). What is nonlinear in p is thus one-sided to a part STEP; the states are
linearised exactly.

A number that moves a corner (of the spring's stiffness, say) leaves no jump in the states' derivatives; those
of torques jump where the corner is passed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.drive import _layout as layout
from hdsim.errors import HdsimError, InputError
from hdsim.nested import at, copied, put
from hdsim.recording import Column, Table
from hdsim.scenario.fields import split_unit
from hdsim.simulation.sample import alike, samples_beside
from hdsim.simulation.setup import build_model, initial_state

if TYPE_CHECKING:
    from hdsim.drive.model import Model
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario

#: Part of itself by which a number is moved: a slider of sharpness p that slips fully is off by 3 p^2 STEP.
STEP = 1e-8
#: The same for what changes a toothed mesh. Its tables come from root finding to 1e-9 of their values: a
#: smaller step would drown in that.
MESH_STEP = 1e-5
#: Sections whose numbers do not belong to the model, but for where it starts.
_NOT_OF_THE_MODEL = ("run", "log", "live")
_START = "run.start."


@dataclass(frozen=True)
class Beside:
    """A scenario's model, and what is integrated beside it.

    Attributes:
        names: of the parameters.
        model: without energies, at its start.
        others: the same with each parameter moved.
        steps: by how much.
    """

    names: tuple[str, ...]
    model: Model
    others: tuple[Model, ...]
    steps: tuple[float, ...]


def models_beside(scenario: Scenario, parameters: Sequence[str]) -> Beside:
    """The models whose differences are derivatives.

    Args:
        scenario: simulated with ``rodas4`` and, if any, a controller that runs continuously.
        parameters: dotted names of numbers, as in ``effects.kinematic_error.components[0].amplitude_arcmin``.

    Raises:
        InputError: a parameter is no number that can be moved, or moving it moves what happens when: then
            there is no derivative at those times.
    """
    settings = scenario.run
    if settings.method != "rodas4":
        raise InputError(f"run.method: found {settings.method!r}; sensitivities are integrated by 'rodas4'")
    if scenario.command.sampled(scenario.drive.ratio) is not None:
        raise InputError("command.motor.sample_period_s: sensitivities need a controller without sampling")
    data = scenario.model_dump(mode="json")
    model = _model(scenario)
    others, steps = [], []
    for name in parameters:
        other, step = _moved(scenario, model, data, name)
        if not alike(model, other, settings.duration_s):
            raise InputError(
                f"{name}: moving it moves when something happens, or what the model is made of (or the ring "
                f"is in static balance); sensitivities are for numbers that leave both as they are"
            )
        others.append(other)
        steps.append(step)
    return Beside(tuple(parameters), model, tuple(others), tuple(steps))


def derivatives(beside: Beside, scenario: Scenario, recording: Recording) -> dict[str, Table]:
    """Derivatives of all channels of the state table but energies and what refers to the command.

    Args:
        beside: of the scenario.
        scenario: what was simulated.
        recording: the run, whose samples are taken.

    Returns:
        For each parameter a table of d channel / d parameter at the recording's times, per unit of the field
        as its name says it. A sample at which something jumps is the first after the jump.

    Raises:
        RunFailed: the integration stopped early.
    """
    channels = [name for name in recording.channels if name in _channels(beside.model)]
    settings = scenario.run
    here, *near = samples_beside(
        beside.model, beside.others, recording.time, channels, rtol=settings.rtol, atol=settings.atol
    )
    found = {}
    for name, there, step in zip(beside.names, near, beside.steps, strict=True):
        per = _unit(name)
        found[name] = Table(
            recording.time,
            {
                channel: Column(
                    (there[channel] - values) / step,
                    _ratio(recording.unit(channel), per),
                    f"change of {channel} with {name}",
                )
                for channel, values in here.items()
            },
        )
    return found


def _model(scenario: Scenario) -> Model:
    """The scenario's model without energies, at its start."""
    model = build_model(scenario, audited=False)
    model.system.y0[:] = initial_state(model, scenario)
    return model


def _channels(model: Model) -> set[str]:
    from hdsim.simulation.channels import Observer

    energies = {"kinetic_energy", "potential_energy"}
    return (set(Observer(model).formulas) | {state.name for state in model.states}) - energies


def _meshes_alike(model: Model, other: Model) -> bool:
    """Whether two models have the same numbers of a mesh."""
    one, two = (m.system.reals[int(m.system.integers[layout.MESH_AT]) :] for m in (model, other))
    return np.array_equal(one, two)


def _moved(scenario: Scenario, model: Model, data: dict[str, Any], name: str) -> tuple[Model, float]:
    """The model with a number a little larger (or, at its upper bound, smaller), and by how much."""
    path = re.sub(r"\[([0-9]+)\]", r".\1", name)
    try:
        value = at(data, path)
    except (KeyError, IndexError, TypeError, ValueError):
        known = [other for other, _ in _numbers(data)]
        near = get_close_matches(name, known, 1, cutoff=0.6)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise InputError(f"found {name!r}, expected the dotted name of a scenario's number{hint}") from None
    if name.split(".")[0] in _NOT_OF_THE_MODEL and not name.startswith(_START):
        raise InputError(f"{name} is no number of the model: it has no sensitivity")
    if isinstance(value, bool) or not isinstance(value, float):
        raise InputError(f"{name} is {value!r}: only numbers that can change a little have a sensitivity")
    if value == 0.0:
        raise InputError(f"{name} is 0, of which no small part can be taken: give it a value")
    kind = type(scenario)
    trouble: HdsimError | ValueError | None = None
    for part in (STEP, -STEP, MESH_STEP, -MESH_STEP):
        changed = copied(data)
        put(changed, path, value + part * value)
        try:
            other = _model(kind.model_validate(changed))
        except (HdsimError, ValueError) as error:
            trouble = error
            continue
        if abs(part) == MESH_STEP or model.teeth is None or _meshes_alike(model, other):
            # The step as rounding leaves it.
            return other, (value + part * value) - value
    raise InputError(f"{name} cannot be moved from {value:g}: {trouble}")


def _numbers(data: Any, before: str = "") -> Iterator[tuple[str, float]]:
    """Every number of nested settings by its dotted name."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _numbers(value, f"{before}.{key}" if before else str(key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from _numbers(value, f"{before}[{index}]")
    elif isinstance(data, float):
        yield before, data


def _unit(name: str) -> str:
    return split_unit(re.sub(r"\[[0-9]+\]", "", name).rsplit(".", 1)[-1])[1]


def _ratio(unit: str, per: str) -> str:
    """Unit of a channel over that of a parameter, which has none when empty."""
    if per in ("", "1"):
        return unit
    return f"{unit}/({per})" if any(c in per for c in " /") else f"{unit}/{per}"
