"""Traces of an earlier screening, as far as they are still those of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdsim.diagnosis.designs import designs
from hdsim.estimate.bench import Bench
from hdsim.estimate.numbers import base_freedoms
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added, State

if TYPE_CHECKING:
    from hdsim.diagnosis.traces import Screening

#: Part by which a number of the base must differ for remembered traces to be tried again, and part of its
#: power that must then be another in an effect's trace for all traces of that effect to be made anew.
MOVED, CHANGED = 0.1, 0.1


#: Traces by all that they depend on, as it is asked for, each with the effect in the units that were used.
Traces = dict[tuple[str, str, tuple[float, ...]], tuple[Added, Array]]


def key_of(added: Added) -> tuple[str, str, tuple[float, ...]]:
    """All that an effect's trace depends on, as it is asked for: two ways of fitting may share a label."""
    return added.effect, repr(added.fitting), added.shapes


def remembered(
    bench: Bench, before: Screening | None, state: State, without: Sequence[Array], sigmas: Array
) -> Traces:
    """Traces of an earlier screening in these weights, but of effects for which they are another model's.

    Where the drive's spring or its load's inertia have moved, the resonance is elsewhere, and what drives it
    shows with another size and sign in another stretch of the record: one trace of each effect is made anew.

    Args:
        bench: the measured series.
        before: the earlier screening, if there is one.
        state: the model.
        without: its predictions.
        sigmas: of every series now.
    """
    if before is None or before.state is None:
        return {}
    factor = (before.sigmas / sigmas)[bench.stacked_series()][:, None]
    seen = {key: (added, columns * factor) for key, (added, columns) in before.seen.items()}
    if not _moved(bench, before.state, state):
        return seen
    present = {added.effect for added in state.added}
    first: dict[str, tuple[Added, Array]] = {}
    for added, columns in seen.values():
        if added.effect not in present:
            first.setdefault(added.effect, (added, columns))
    there = designs(bench, state, without, [added for added, _ in first.values()])
    changed = {
        name
        for (name, (_, columns)), anew in zip(first.items(), there, strict=True)
        if anew is None or _unlike(columns, anew) > CHANGED
    }
    return {key: trace for key, trace in seen.items() if trace[0].effect not in changed}


def _moved(bench: Bench, before: State, now: State) -> bool:
    """Whether a number of the base differs by much."""
    first, last = (
        {free.name: free.value for free in base_freedoms(state, bench.channels, load_known=bench.load_known)}
        for state in (before, now)
    )
    return any(abs(value - first.get(name, 0.0)) > MOVED * abs(value) for name, value in last.items())


def _unlike(columns: Array, anew: Array) -> float:
    """Part of the power of a design's columns, the largest, that another design's cannot explain."""
    rest = anew - columns @ np.linalg.lstsq(columns, anew, rcond=None)[0]
    power = (anew**2).sum(axis=0)
    return float(np.max((rest**2).sum(axis=0)[power > 0] / power[power > 0], initial=0.0))
