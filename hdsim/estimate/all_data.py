"""Numbers estimated from all that was measured, once held-out stretches have judged the model.

A model is chosen and judged by a part of the data; what is then the best estimate of its numbers uses them
all (T. Hastie, R. Tibshirani and J. Friedman 2009, *The Elements of Statistical Learning*, section 7.10). A
joint that starts once and stops once shows friction and inertia apart only by the two together: 18 % above
its maker's friction by all but the stop, 5 % with it, from any base. Records that were held out as a whole
stay unseen.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.drift import drifted
from hdsim.estimate.fit import Fit, sharpened
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.refit import align, at_its_end, reweigh, together
from hdsim.estimate.series import Counted


def refuse_held_out_records(all_data: bool, holdout: Sequence[object]) -> None:
    """Refuse to estimate from all data where records are held out as a whole.

    Raises:
        InputError: both are asked for.
    """
    if all_data and holdout:
        raise InputError("--all-data: records of --holdout are used in no fit; leave out one of the two")


@contextlib.contextmanager
def on_all_data(
    bench: Bench, found: Fit, left: Callable[[Fit], tuple[Array, Array] | None] = lambda _: None
) -> Iterator[Fit]:
    """A fit carried on to the end that all rows ask for, which fits see for as long as it is looked at.

    Args:
        bench: the measured series.
        found: the fit, at its end by the training rows.
        left: columns and sizes of what else may have moved the numbers (``drifted``).

    Yields:
        The fit; ``found``, and its rows, where all of them cannot be followed.
    """
    counted, final = Counted(bench.series), found
    for series in bench.series:
        if series.record < bench.training:
            series.train = series.train | series.hold
    try:
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            there = sharpened(bench, replace(found, beside=None))
            align(bench, there)
            reweigh(bench, there)
            there = together(bench, at_its_end(bench, there))
            final = drifted(bench, there, left(there))
        if final is found:
            counted.put_back()
        yield final
    finally:
        counted.put_back()
