"""How exactly records are predicted: as closely as their sensors tell, and no more so.

What an integrator errs by is noise in a finite difference, and looks like information there: n samples of an
error e say n (e / step)^2 of a number of which the data say nothing. Where that is little beside what was
believed before, what is more exact costs steps that no data reward.
"""

from __future__ import annotations

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import RTOL, PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import State

#: Part of a channel's noise that the integrator may err by, root mean square. Differences err by two thirds
#: of that at most, for errors are partly the same in both runs: numbers that the data hardly tell heard at
#: most 0.06 of a prior's information in it (11 cases of ``benchmarks/diagnose_time.py``, 900 to 49,000 rows).
PART = 1e-3
#: Loosest tolerance of a fit, and that of the prediction that it is held against.
LOOSEST, REFERENCE = 1e-5, 1e-7


def as_exact_as_told(bench: Bench, state: State) -> None:
    """Set the predictors' tolerances: each record's own, from ``LOOSEST`` down to ``RTOL``.

    The error of a method that controls it in every step goes with its tolerance (E. Hairer, S. P. Norsett,
    G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., Springer 1993, section II.4). A drive
    with teeth keeps ``RTOL``: its tables come from root finding.

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

    errors = dict.fromkeys(range(len(bench.predictors)), 0.0)
    try:
        here, closely = predicted(LOOSEST), predicted(REFERENCE)
    except PredictionError:
        errors = dict.fromkeys(errors, np.inf)
    else:
        for series, one, other in zip(bench.series, here, closely, strict=True):
            error = float(np.sqrt(np.mean((one - other) ** 2))) / max(series.noise, 1e-300)
            errors[series.record] = max(errors[series.record], error)
    for index, predictor in enumerate(bench.predictors):
        predictor.rtol = float(np.clip(LOOSEST * PART / max(errors[index], PART), RTOL, LOOSEST))
        predictor.steps.clear()  # these runs are no measure of others
