"""How exactly records are predicted: as closely as their sensors tell, and no more so.

What an integrator errs by is noise in a finite difference, and looks like information there: n samples of an
error e say n (e / step)^2 of a number of which the data say nothing. Where that is little beside what was
believed before, what is more exact costs steps that no data reward.
"""

from __future__ import annotations

import contextlib

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import RTOL, PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import State

#: Part of a channel's noise that the integrator may err by, root mean square. Differences err by two thirds
#: of that at most, for errors are partly the same in both runs: numbers that the data hardly tell heard at
#: most 0.03 of a prior's information in it (11 cases of ``benchmarks/diagnose_time.py``, 900 to 49,000 rows).
PART = 5e-4
#: Tolerances that are tried, the loosest first, before ``RTOL``, and that of the prediction beside them.
TRIED, REFERENCE = (1e-5, 3e-6), 1e-7


def as_exact_as_told(bench: Bench, state: State) -> None:
    """Set the predictors' tolerances: of each record the loosest whose error is small beside its noise.

    A drive with teeth keeps ``RTOL``: its tables come from root finding.

    Args:
        bench: the measured series.
        state: a model of the kind that is going to be fitted.
    """
    if state.toothed:
        return

    def predicted(rtol: float) -> list[Array]:
        for predictor in bench.predictors:
            predictor.rtol = rtol
        return bench.predict(state, everything=True)

    chosen: dict[int, float] = {}
    with contextlib.suppress(PredictionError):
        closely = predicted(REFERENCE)
        for rtol in TRIED:
            errors = dict.fromkeys(range(len(bench.predictors)), 0.0)
            for series, one, other in zip(bench.series, predicted(rtol), closely, strict=True):
                error = float(np.sqrt(np.mean((one - other) ** 2))) / max(series.noise, 1e-300)
                errors[series.record] = max(errors[series.record], error)
            for index, error in errors.items():
                if error <= PART:
                    chosen.setdefault(index, rtol)
            if len(chosen) == len(errors):
                break
    for index, predictor in enumerate(bench.predictors):
        predictor.rtol = chosen.get(index, RTOL)
        predictor.steps.clear()  # these runs are no measure of others
