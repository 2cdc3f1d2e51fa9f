"""Step 5a, one trace: what each coefficient of an effect changes in the whitened predictions."""

from __future__ import annotations

from collections.abc import Sequence
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
    found = list(zip(tried, designs(bench, state, predictions, tried), strict=True))
    again: dict[int, Added] = {}
    for k, (added, columns) in enumerate(found):
        if columns is None or added.fitting.cumulative or added.fitting.play:
            continue
        size = float(np.sqrt(np.mean(columns**2, axis=0).max(initial=0.0)))
        if size > 0 and not wanted / FITTING < size < wanted * FITTING:
            # A stronger one than is plausible may be no drive: stiffness all round that is more than its own.
            factor = min(float(np.clip(wanted / size, 1e-3, 1e5)), max(1.0, added.to_plausible(state.drive)))
            again[k] = replace(added, fitting=added.fitting.rescaled(factor))
    for (k, added), columns in zip(
        again.items(), designs(bench, state, predictions, list(again.values())), strict=True
    ):
        if columns is not None:
            found[k] = (added, columns)
    return found


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
