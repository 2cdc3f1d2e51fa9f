"""Whether one tooth out of place could be one of the other spline.

The teeth of the flexspline come round 2 (1 - 1/i) times in a turn of the wave generator, those of a fixed
circular spline twice, so a record of few turns sees both pass at nearly the same angles. The model is fitted
with a tooth of the other spline instead, beside all else that is free. The two have as many free numbers and
neither holds the other, so they are compared by what each leaves of every block of time (Vuong 1989,
Econometrica 57:307), as names are.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.diagnosis.designs import designs
from hdsim.diagnosis.name import SAME
from hdsim.diagnosis.starts import neighbours, starts
from hdsim.effects import catalogue
from hdsim.effects._fitting import Fitting
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, added_spreads, at_present, fit, settled
from hdsim.estimate.flanks import widen_by_flanks
from hdsim.estimate.found import ParameterEstimate
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added
from hdsim.estimate.write import fitted_numbers

#: Evaluations of the fit with the other spline's tooth, which begins at every half distance of two starts.
EVALUATIONS = 14


def of_other_spline(bench: Bench, found: Fit, k: int, field: str) -> tuple[str, ParameterEstimate] | None:
    """Spline and number of another tooth that leaves no more than the one that was named.

    Args:
        bench: the measured series, weighed.
        found: the model with the tooth.
        k: which of its effects.
        field: that holds the tooth's number.

    Returns:
        None where the data tell the two apart, or the other cannot be predicted.
    """
    added = found.state.added[k]
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        with bench.coarse():
            whole = _fitted(bench, found, k, _others(bench, found, added))
            if whole is None or _told_apart(bench, found, whole, k):
                return None
            whole = settled(bench, whole)
            widen_by_flanks(bench, whole)
        _, covariance, shapes = added_spreads(whole)[k]
        other = whole.state.added[k]
        number = fitted_numbers(other, covariance, shapes)[field]
        return str(other.settings()["member"]), number
    return None


def _others(bench: Bench, found: Fit, added: Added) -> list[Added]:
    """Teeth all around the other spline, as far out of place as the named one."""
    ranges, own = bench.ranges(found.state), added.settings()
    tried: list[Added] = []
    fittings: tuple[Fitting, ...] = getattr(catalogue()[added.effect], "fittings", ())
    for fitting in fittings:
        if fitting.settings["member"] == own["member"]:
            continue
        for one in starts(added.effect, fitting, (), ranges):
            size = own["shift_um"] / one.settings()["shift_um"]
            if size > 0:  # what is early is no late one
                several = [one, *neighbours(one, 0)[1:]]
                tried += [replace(each, fitting=each.fitting.rescaled(size)) for each in several]
    return tried


def _fitted(bench: Bench, found: Fit, k: int, tried: Sequence[Added]) -> Fit | None:
    """The model with the one of other teeth that explains most of what is left without the named one."""
    added = found.state.added
    rest = replace(found.state, added=(*added[:k], *added[k + 1 :]))
    predictions = bench.predict(rest)
    left = bench.stacked(bench.residuals(predictions))
    columns = designs(bench, rest, predictions, tried)
    shares = [_explained(left, one) for one in columns]
    if not shares or max(shares) <= 0:
        return None
    state = replace(found.state, added=(*added[:k], tried[int(np.argmax(shares))], *added[k + 1 :]))
    return fit(bench, state, at_present(found), prune=False, evaluations=EVALUATIONS, after=found, rough=True)


def _explained(left: Array, columns: Array | None) -> float:
    """Power of a residual along the only column of a trace."""
    if columns is None or not np.any(columns):
        return 0.0
    column = columns[:, 0]
    return float((column @ left) ** 2 / (column @ column))


def _told_apart(bench: Bench, found: Fit, other: Fit, k: int) -> bool:
    """Whether the other leaves more, by more than chance over blocks and a part of what is explained."""
    added = found.state.added
    rest = replace(found.state, added=(*added[:k], *added[k + 1 :]))
    own, rival, none = (
        bench.block_powers(each) for each in (found.predictions, other.predictions, bench.predict(rest))
    )
    difference = rival - own
    spread = float(np.sqrt(len(difference)) * difference.std())
    return float(difference.sum()) > max(2.0 * spread, SAME * float((none - own).sum()))
