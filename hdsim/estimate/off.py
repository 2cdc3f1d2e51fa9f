"""Which of the base's numbers are wrong, where they explain what the data show and no effect is missing.

Of ten numbers whose 95 % intervals are honest one lies outside in two records of five, whatever is wrong. So
those whose intervals exclude what was given are the wrong ones only where they explain what the re-fit did;
otherwise others, which stand in for one another and have wide intervals, did most of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.numbers import Interval
from hdsim.estimate.records import Array

#: Part of what the number that can do most alone can do, for another to do as well.
ALONE = 0.8
#: Part of what a re-fit did that numbers which are said to be wrong must explain: more than all others do.
MOST = 0.5


def wrong_numbers(
    bench: Bench, before: Sequence[Array], found: Fit, intervals: Sequence[Interval]
) -> list[Interval]:
    """The numbers that are wrong: all that moved, or others that did not, of which one is.

    Args:
        bench: the measured series.
        before: predictions of the model as given.
        found: the fit.
        intervals: its numbers.
    """
    moved = [interval for interval in intervals if interval.moved]
    if moved and _done_by(bench, before, found, {interval.name for interval in moved}) >= MOST:
        return moved
    return [interval for interval in tie(bench, before, found, intervals) if not interval.moved] or moved


def _done_by(bench: Bench, before: Sequence[Array], found: Fit, names: set[str]) -> float:
    """Part of the power of what a fit changed that some of its numbers could have changed alone."""
    own = [k for k, free in enumerate(found.frees) if free.name in names]
    change = bench.trace(before, found.predictions)
    moves, *_ = np.linalg.lstsq(found.columns[:, own], change, rcond=1e-9)
    left = change - found.columns[:, own] @ moves
    return 1.0 - float(left @ left) / max(float(change @ change), 1e-300)


def tie(bench: Bench, before: Sequence[Array], found: Fit, intervals: Sequence[Interval]) -> list[Interval]:
    """Numbers each of which would do most of what a fit did alone, the best first, tied to one another.

    They stand in for one another: no interval may exclude its start value, although one of them is off.

    Args:
        bench: the measured series.
        before: predictions of the model as given.
        found: the fit.
        intervals: its numbers; those that are found are marked as tied. None that is not ``resolved`` is one:
            what that does is done for what the measured motion lacks.
    """
    columns, frees = found.columns[:, : len(found.frees)], list(found.frees)
    if found.beside is not None:
        there = found.beside[0][:, : len(found.undetermined)]
        columns, frees = np.hstack([columns, there]), frees + found.undetermined
    if not frees:
        return []
    along = columns.T @ bench.trace(before, found.predictions)
    power = along**2 / np.maximum((columns**2).sum(axis=0), 1e-300)
    by_name = {interval.name: interval for interval in intervals}
    order = [int(k) for k in np.argsort(-power) if power[k] >= ALONE * power.max()]
    tied = [one for one in (by_name[frees[k].name] for k in order) if one.resolved]
    for one in tied:
        one.tied_to = [other.name for other in tied if other is not one]
    return tied
