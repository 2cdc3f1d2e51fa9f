"""Records that begin in the middle of a motion, of whose vibration a model knows neither size nor phase.

A prediction begins as if the motion had always gone on at its first speed. Where it had not, nor begins at
rest, the load swings, in the log or in the prediction, and dies down at a rate that nobody knows, for
damping is a guess; a fit would bend every number of the model to follow it. So its place is asked, not its
law. Of a hundred stretches of a record that are all alike, the first leaves more than each of the ninety
beyond the first tenth in one case of 91 (a rank test: E. L. Lehmann, *Nonparametrics*, Springer 2006,
section 1.2). Then it does not count, nor do those that follow it up to the first that leaves no more than
they do. Each channel is asked by itself: what a shaft at rest leaves in another one hides no vibration. By
chance that costs a hundredth of a record; where something missing acts at the beginning most, a tenth of it
at most. Only what dies down meanwhile may be followed further, as a lightly damped vibration in a short
record must be: what is left of it would bend the damping.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdsim.estimate.bench import SETTLE_S, Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.predict import Predictor
from hdsim.estimate.records import Array
from hdsim.estimate.standstill import at_rest

#: Stretches of a record, and those of them that may be left out; fewest samples in one of them.
STRETCHES, EARLY, SAMPLES = 100, 10, 4
#: Stretches that what dies down may take (chosen: fits keep most of a record), and what of the first one's
#: power the last of the early ones then has at most: twice as far on it has less than a tenth.
LATEST, DIES = 30, 0.3


def hear_beginning(bench: Bench, predictions: Sequence[Array], *, first: int = 0) -> bool:
    """Leave out the beginnings of records that leave more than all that follows.

    Args:
        bench: the measured series, weighed; their masks are changed.
        predictions: of a model near the data.
        first: number of the first record that is asked; held-out records come last, and only who proves a
            model there has its predictions of them.

    Returns:
        Whether something was left out.
    """
    residuals, heard = bench.residuals(predictions), False
    for index, predictor in enumerate(bench.predictors):
        if index < first:
            continue
        time = predictor.record.time
        if len(time) < SAMPLES * STRETCHES or begins_at_rest(predictor):
            continue
        own = [k for k, s in enumerate(bench.series) if s.record == index and len(residuals[k])]
        # Stretches of as many samples that count, or the shorter ones would scatter more.
        weight = np.sum([bench.series[k].train | bench.series[k].hold for k in own], axis=0).cumsum()
        stretch = np.minimum((weight - 1) * STRETCHES // max(int(weight[-1]), 1), STRETCHES - 1).clip(0)
        late, most = 0, EARLY
        for series, rest in ((bench.series[k], residuals[k]) for k in own):
            rows = series.train | series.hold
            power = np.bincount(stretch[rows], rest[rows] ** 2, STRETCHES)
            count = np.bincount(stretch[rows], minlength=STRETCHES)
            mean = np.divide(power, count, out=np.zeros(STRETCHES), where=count > 0)
            quiet = np.flatnonzero(mean[:EARLY] <= mean[EARLY:].max())
            late = max(late, int(quiet[0]) if len(quiet) else EARLY)
            if late and mean[EARLY - 1] < DIES * mean[0]:
                most = LATEST
        begins_s = min(
            time[int(np.argmax(stretch >= late))] - time[0], (time[-1] - time[0]) * most / STRETCHES
        )
        if late == 0 or begins_s <= bench.begins_s.get(index, 0.0):
            continue
        later = time - time[0] >= begins_s
        for k in own:
            series = bench.series[k]
            series.train, series.hold = series.train & later, series.hold & later
        bench.begins_s[index] = float(begins_s)
        heard = True
    return heard


def begins_at_rest(predictor: Predictor) -> bool:
    """Whether a record begins at rest, as its prediction does: then nothing swings yet."""
    slow = at_rest(predictor)
    return bool(slow[predictor.record.time - predictor.record.time[0] <= SETTLE_S].all())


def beginnings(bench: Bench) -> list[Problem]:
    """What was left out, and which loads swing beside the model, for the report."""
    swings = [
        Problem(
            bench.predictors[index].record.name,
            "time",
            "beginning",
            "info",
            "begins in a motion of unknown history: how its load swings then is fitted to it",
        )
        for index in bench.swings
    ]
    return swings + [
        Problem(
            bench.predictors[index].record.name,
            "time",
            "beginning",
            "info",
            f"begins in a motion of unknown history: the first {seconds:.2g} s, a vibration, do not count",
        )
        for index, seconds in bench.begins_s.items()
    ]
