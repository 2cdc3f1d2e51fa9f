"""Some channels of a model at given times, in one compiled call: what a fit asks for a thousand times.

The steps are those of ``Run``; nothing is logged, watched or audited, and only what is asked for is computed.
A model that is built with ``audited=False`` does not even integrate its energies, whose accuracy would
otherwise set the step (a torque ripple's power is quicker than anything that moves).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import _layout as layout
from hdsim.recording import Column, Table
from hdsim.simulation.channels import Observer
from hdsim.simulation.failures import FASTEST, speed_guard, told
from hdsim.simulation.run import RunFailed
from hdsim.simulation.spans import cuts, stops

if TYPE_CHECKING:
    from hdsim.drive.model import Model
    from hdsim.simulation.rosenbrock import Beside
    from hdsim.simulation.solvers import Integration

Array = NDArray[np.float64]

#: Steps of a run over those of one like it at which it is given up: its numbers have made a system of it that
#: moves as no drive does (chosen: most effects take up to three times those of the plain drive, while a curve
#: over the twist that had become a cliff took 10,000 times, and two minutes).
FAR_MORE = 100.0


@dataclass(frozen=True)
class SetFree:
    """A time at which the states of a model, and of those beside it, jump.

    Attributes:
        at_s: the time, s, before the last that is sampled.
        jumps: of the model's states and those of each of the others, shape (1 + others, states).
    """

    at_s: float
    jumps: Array


def sample(
    model: Model,
    times: Array,
    channels: Sequence[str],
    *,
    rtol: float = 1e-6,
    atol: float | Array | None = None,
    steps: list[int] | None = None,
) -> dict[str, Array]:
    """Run a model from rest at time 0 to the last of the times.

    Args:
        model: the drive with its parts.
        times: when the channels are wanted, shape (m,), s, increasing, not before 0.
        channels: names in ``Observer.formulas``, or of states that parts add.
        rtol: relative tolerance.
        atol: absolute tolerance of the states in their units; rtol times each state's scale when None.
        steps: of runs alike. One that takes ``FAR_MORE`` times those of the first (or one a sample, where
            that is more) fails. Gets the number that this one has taken, rejected ones included.

    Returns:
        The channels, shape (m,) each; beside those with a sensor what it reads, as ``measured_...``.

    Raises:
        InputError: there is no such channel.
        RunFailed: the integration stopped before the end; the message says why.
    """
    return samples_beside(model, (), times, channels, rtol=rtol, atol=atol, steps=steps)[0]


def samples_beside(
    model: Model,
    others: Sequence[Model],
    times: Array,
    channels: Sequence[str],
    *,
    rtol: float = 1e-6,
    atol: float | Array | None = None,
    steps: list[int] | None = None,
    set_free: SetFree | None = None,
) -> list[dict[str, Array]]:
    """Run a model, and others that differ so little from it that they may be linearised beside it.

    Costs a fraction of a run for each of the others (``hdsim.simulation._beside``), and their difference from
    the first is free of what two integrations would differ by.

    Args:
        model: the drive with its parts.
        others: models that are ``alike``, but for their numbers.
        times: see ``sample``.
        channels: likewise.
        rtol: likewise.
        atol: likewise.
        steps: likewise.
        set_free: when the states of the models jump, and by how much.

    Returns:
        What ``sample`` returns, of the model and of each other one.

    Raises:
        InputError: there is no such channel.
        RunFailed: the integration stopped before the end; the message says why.
    """
    from hdsim.simulation.rosenbrock import rodas4_through

    times = np.ascontiguousarray(times, dtype=np.float64)
    sensors = {c: s for c, s in model.sensors.items() if c in channels}
    needed = {name for chain in sensors.values() for sensor in chain for name in sensor.needs}
    asked = tuple(dict.fromkeys([*channels, *sorted(needed), "motor_velocity"]))
    observers = [Observer(one) for one in (model, *others)]
    grid = _reaching_back(times, max(each.memory for each in observers)) if sensors else times

    system, end = model.system, float(times[-1])
    jumps_at = [] if set_free is None else [np.array([set_free.at_s])]
    spans = cuts(model.signals, end, *jumps_at)

    def through(spans: Array, y0: Array, near: Array, grid: Array, first_step: float | None) -> Integration:
        return rodas4_through(
            system,
            spans,
            y0,
            grid,
            rtol=rtol,
            atol=rtol * system.scale if atol is None else atol,
            stops=stops(model, end),
            inside_at=layout.INSIDE,
            guard=speed_guard(model),
            first_step=first_step,
            others=replace(_beside(model, others), y0=near) if others else None,
            most_steps=FAR_MORE * max(steps[0], len(grid)) if steps else np.inf,
        )

    near = np.array([other.system.y0 for other in others]).reshape(len(others), system.size)
    if set_free is None:
        found = through(spans, system.y0, near, grid, None)
    else:
        found = _set_free(through, set_free, spans, system.y0, near, grid)
    if steps is not None and found.statistics is not None:
        steps.append(found.statistics.steps + found.statistics.rejected)
    if not found.success:
        raise RunFailed(told(model, found))
    # What jumps at a time has jumped already.
    span = np.clip(np.searchsorted(spans, grid, side="right") - 1, 0, len(spans) - 2)
    inside = 0.5 * (spans[span] + spans[span + 1])
    states = [found.y.T]
    if others:
        assert found.beside is not None
        states += [found.y.T + difference for difference in found.beside]
    at = slice(None) if grid is times else np.searchsorted(grid, times)
    every = []
    for observer, y in zip(observers, states, strict=True):
        true = observer.values(asked, grid, y, inside)
        if observer is observers[0] and np.max(np.abs(true["motor_velocity"])) > FASTEST:
            # Where it is prescribed, no state tells.
            raise RunFailed(f"RunawayError: motor velocity exceeds {FASTEST:g} rad/s.")
        read = {}
        if sensors:
            own = {c: observer.model.sensors[c] for c in sensors}
            history = Table(grid, {name: Column(values, "") for name, values in true.items()})
            read = {name: column.values for name, column in observer.sensed(history, times, own).items()}
        every.append({name: true[name][at] for name in channels} | read)
    return every


def alike(model: Model, other: Model, end_s: float) -> bool:
    """Whether a model can be linearised beside another up to a time: the same parts, other numbers.

    A ring in static balance is found by iteration in each right-hand side, and what that leaves is no
    difference of two models.
    """
    one, two = model.system, other.system
    pairs = zip(model.signals, other.signals, strict=False)
    return (
        one.integers[layout.RING] != layout.RING_STATIC
        and one.quadratures == two.quadratures == 0
        and np.array_equal(one.integers, two.integers)
        and len(one.reals) == len(two.reals)
        and len(one.y0) == len(two.y0)
        and model.sensors.keys() == other.sensors.keys()
        and all(a is b or np.array_equal(a.corners(0.0, end_s), b.corners(0.0, end_s)) for a, b in pairs)
    )


def _set_free(
    through: Callable[[Array, Array, Array, Array, float | None], Integration],
    set_free: SetFree,
    spans: Array,
    y0: Array,
    near: Array,
    grid: Array,
) -> Integration:
    """The integration up to where the states jump, and from there on, as one."""
    at_s, jumps = set_free.at_s, set_free.jumps
    early = grid < at_s
    first = through(spans[spans <= at_s], y0, near, np.append(grid[early], at_s), None)
    if not first.success:
        return first
    there = first.y[:, -1]
    beside = first.beside[:, -1] if first.beside is not None else np.zeros((0, len(there)))
    near = there + beside + jumps[1:]
    second = through(spans[spans >= at_s], there + jumps[0], near, grid[~early], first.next_step)
    if first.statistics is not None and second.statistics is not None:
        second.statistics.add(first.statistics)
    second.t, second.y = np.append(first.t[:-1], second.t), np.hstack([first.y[:, :-1], second.y])
    if first.beside is not None and second.beside is not None:
        second.beside = np.concatenate([first.beside[:, :-1], second.beside], axis=1)
    return second


def _beside(model: Model, others: Sequence[Model]) -> Beside:
    """Numbers of the models beside one, and which of them share all but their elements and inertias with it.

    Coordinates, kinematic error and mesh, the dearest part where it has teeth, see the angles, signals and
    their own numbers alone: a model with another inertia, friction or gain need not compute them again.
    """
    from hdsim.simulation.rosenbrock import Beside

    system = model.system
    reals = np.stack([other.system.reals for other in others])
    integers = np.stack([other.system.integers for other in others])
    if not model.rigid:
        seen = np.ones(len(system.reals), dtype=bool)
        seen[layout.INSIDE : layout.INERTIA + 3] = seen[layout.HOUSING_INERTIA] = False
        # The elements' numbers come first; twists', signals' and the mesh's own follow.
        first = layout.LISTS + layout.PER_ELEMENT * system.integers[layout.ELEMENTS]
        places = system.integers[first + 1 : system.integers[layout.ON_SPRING_AT] : 2]
        seen[layout.PARAMETERS : min([int(system.integers[layout.MESH_AT]), *places])] = False
        integers[:, layout.GIVEN] = (reals[:, seen] == system.reals[seen]).all(axis=1)
    return Beside(
        reals,
        np.stack([other.system.y0 for other in others]),
        integers,
        integers[:, layout.GIVEN] != 0,
    )


def _reaching_back(times: Array, memory_s: float) -> Array:
    """The times with others between and before them, as close, where sensors look back into the past."""
    if memory_s == 0.0 or len(times) < 2:
        return times
    period = float(np.median(np.diff(times)))
    first = max(0.0, times[0] - memory_s - 2.0 * period)
    count = math.ceil((times[-1] - first) / period)
    even = times[-1] - period * np.arange(count, 0, -1.0)
    even = even[even >= 0.0]
    after = np.clip(np.searchsorted(times, even), 1, len(times) - 1)
    # Nothing is gained beside a time that is asked for.
    apart = np.minimum(np.abs(times[after] - even), np.abs(even - times[after - 1])) > 0.4 * period
    return np.sort(np.concatenate([times, even[apart]]))
