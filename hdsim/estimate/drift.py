"""Numbers beside torque sensors whose zeros drift from one record to the next.

Fits hold a torque's zero to be one in all records, for what differs between them at constant speed is
friction. A sensor's zero moves a little nevertheless, and a fit takes each record's for torque: where one
record lies on one side of zero and the next on the other, stiffness and weight follow. So at the end each
record's zero is one more number, with the prior of ``offsets.drift_columns``: numbers take the step that the
data ask for beside them, and the intervals cover it (a random effect of each record: N. M. Laird and J. H.
Ware 1982, Biometrics 38:963).
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import robust_covariance
from hdsim.estimate.fit import Fit, at_present
from hdsim.estimate.flanks import widen_by_flanks
from hdsim.estimate.offsets import drift_columns
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.vector import Vector

#: Parts of the step that are tried, the first that leaves less is taken: predictions are nearly linear in it.
PARTS = (1.0, 0.5, 0.25)


def drifted(bench: Bench, found: Fit, left: tuple[Array, Array] | None = None) -> Fit:
    """A fit with the zeros of its records free within what zeros drift.

    Args:
        bench: the measured series, weighed.
        found: a fit at its end.
        left: columns, whitened, (rows, k), of what else may have moved its numbers, and their sizes (k,): it
            widens their intervals alone.
    """
    drifts, spreads = drift_columns(bench.series, bench.training, bench.zeros)
    hidden = [(drifts, spreads)] if left is None else [(drifts, spreads), left]
    if not found.columns.size or not any(columns.size for columns, _ in hidden):
        return found
    rest = bench.stacked(bench.residuals(found.predictions))
    vector = Vector(found.state, tuple(at_present(found)), 0)
    moved = found
    if drifts.size:
        moved, rest = _stepped(bench, found, vector, rest, drifts, spreads)
    if found.beside is not None:
        hidden = [found.beside, *hidden]
    beside = np.hstack([columns for columns, _ in hidden]), np.concatenate([sizes for _, sizes in hidden])
    priors, blocks = vector.priors(), bench.stacked_blocks()
    moved = replace(moved, covariance=robust_covariance(found.columns, rest, blocks, priors, beside))
    widen_by_flanks(bench, moved)
    return moved


def _stepped(
    bench: Bench, found: Fit, vector: Vector, rest: Array, drifts: Array, spreads: Array
) -> tuple[Fit, Array]:
    """The fit with the step that its numbers take beside the drifts, and what it and those leave, (rows,)."""
    start, priors = vector.start(), vector.priors()
    columns, both = np.hstack([found.columns, drifts]), np.concatenate([priors, spreads])
    # What the zeros bend no sample is worth less for.
    whole, *_ = np.linalg.lstsq(columns * both, rest, rcond=1e-6)
    apart = rest - columns * both @ whole
    power = bench.sample_power(apart)
    inner = np.linalg.inv(drifts.T @ drifts / power + np.diag(1.0 / spreads**2))

    def beside(rest: Array) -> Array:
        """What a residual leaves where the zeros have drifted as is likeliest."""
        return rest - drifts @ (inner @ (drifts.T @ rest)) / power

    def against(rest: Array, x: Array) -> float:
        far = (x - vector.centre(start)) / priors
        return float(rest @ beside(rest)) / power + float(far @ far)

    # At its end a fit's own numbers are pulled nowhere; only the zeros are.
    pull = np.concatenate([np.zeros(len(start)), drifts.T @ rest])
    step = np.linalg.solve(columns.T @ columns + power * np.diag(1.0 / both**2), pull)[: len(start)]
    lower, upper = vector.bounds()
    for part in PARTS:
        x = np.clip(start + part * step, np.minimum(lower, start), np.maximum(upper, start))
        with contextlib.suppress(PredictionError):
            state = vector.state(x)
            predictions = bench.predict(state)
            there = bench.stacked(bench.residuals(predictions))
            if against(there, x) < against(rest, start):
                theta = found.theta + x[: len(found.frees)]
                return replace(found, state=state, theta=theta, predictions=predictions), beside(there)
    return found, beside(rest)
