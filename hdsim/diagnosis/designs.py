"""Step 5a, one trace: what each coefficient of an effect changes in the whitened predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added, State

#: Factor within which a trace's size must fit the residual's; else its unit is changed.
FITTING = 4.0


def traces(
    bench: Bench, state: State, predictions: Sequence[Array], tried: Sequence[Added], wanted: float
) -> list[tuple[Added, Array | None]]:
    """Change of the whitened predictions for each coefficient at 1 alone, shape (rows, k).

    Args:
        bench: the measured series.
        state: the model without the effects.
        predictions: its predictions.
        tried: the effects; each is simulated apart.
        wanted: root-mean-square that a trace should have; units that are far too small or large for this
            drive are changed, and the trace is simulated again.

    Returns:
        Every effect in the units that were used, with its design, None where it could not be predicted.
    """
    found: list[tuple[Added, Array | None]] = [(added, None) for added in tried]

    def simulate(asked: Mapping[int, Added]) -> None:
        of_all = designs(bench, state, predictions, list(asked.values()))
        for (k, added), columns in zip(asked.items(), of_all, strict=True):
            if columns is not None:
                found[k] = (added, columns)

    def fitting_factor(k: int) -> float:
        """By which a unit has to change."""
        added, columns = found[k]
        if columns is None or added.fitting.cumulative or added.fitting.play:
            return 1.0
        size = float(np.sqrt(np.mean(columns**2, axis=0).max(initial=0.0)))
        if size == 0.0 or wanted / FITTING < size < wanted * FITTING:
            return 1.0
        # A stronger one than is plausible may be no drive: stiffness all round that is more than its own.
        return min(float(np.clip(wanted / size, 1e-3, 1e5)), max(1.0, added.to_plausible(state.drive)))

    # What one start of an effect's shapes needs, the others need as a rule, and are not simulated in vain.
    ways = [(added.effect, added.fitting.label) for added in tried]
    first = {way: ways.index(way) for way in ways}
    simulate({k: tried[k] for k in first.values()})
    factors = {way: fitting_factor(k) for way, k in first.items()}
    rest = {k: factors[way] for k, way in enumerate(ways) if k != first[way]}
    simulate({k: _rescaled(tried[k], factor) for k, factor in rest.items()})
    # Where that cannot be predicted, its own may be.
    simulate({k: tried[k] for k, factor in rest.items() if factor != 1.0 and found[k][1] is None})
    again = {k: fitting_factor(k) for k in range(len(tried))}
    simulate({k: _rescaled(found[k][0], factor) for k, factor in again.items() if factor != 1.0})
    return found


def _rescaled(added: Added, factor: float) -> Added:
    """An effect in units that are so many times what they were."""
    return added if factor == 1.0 else replace(added, fitting=added.fitting.rescaled(factor))


def designs(
    bench: Bench, state: State, predictions: Sequence[Array], tried: Sequence[Added]
) -> list[Array | None]:
    """The design of every effect in its own units, see ``traces``."""
    states = []
    for added in tried:
        count = len(added.coefficients)
        below = 1.0 if added.fitting.cumulative else 0.0
        for k in range(count):
            unit = tuple(1.0 if j == k else below if j < k else 0.0 for j in range(count))
            states.append(replace(state, added=(*state.added, replace(added, coefficients=unit))))
    there = iter(bench.predict_all(states))
    found: list[Array | None] = []
    for added in tried:
        own = [next(there) for _ in added.coefficients]
        columns: list[Array] = []
        before: Sequence[Array] = predictions
        for one in own:
            if one is None:
                break
            columns.append(bench.trace(before, one))
            if added.fitting.cumulative:
                before = one
        found.append(np.column_stack(columns) if len(columns) == len(own) else None)
    return found
