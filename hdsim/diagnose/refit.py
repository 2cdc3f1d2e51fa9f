"""Step 3, re-fit first: the numbers that the base model already has, before anything is called missing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdsim.diagnose.bench import Bench
from hdsim.diagnose.fit import Fit, Vector, base_intervals, fit, robust_covariance, sensitivities
from hdsim.diagnose.freedom import Free, Interval, State, base_freedoms
from hdsim.diagnose.measured import Array

#: Part of what the number that can do most alone can do, for another to do as well.
ALONE = 0.8


@dataclass
class Refit:
    """The base model with its own numbers fitted.

    Attributes:
        fit: the fitted model.
        freedoms: the numbers as they were.
        intervals: each with its interval, or marked as not determined by these data.
        before: predictions of the model as given.
    """

    fit: Fit
    freedoms: list[Free]
    intervals: list[Interval]
    before: list[Array]

    @property
    def moved(self) -> list[Interval]:
        """Numbers whose start value lies outside their interval."""
        return [interval for interval in self.intervals if interval.moved]

    def tie(self, bench: Bench) -> list[Interval]:
        """Numbers each of which would do most of what the re-fit did alone, the best first, tied to another.

        They stand in for one another: no interval may exclude its start value, although one of them is off.
        """
        columns, frees = self.fit.columns[:, : len(self.fit.frees)], list(self.fit.frees)
        if self.fit.beside is not None:
            columns, frees = np.hstack([columns, self.fit.beside[0]]), frees + self.fit.undetermined
        along = columns.T @ bench.trace(self.before, self.fit.predictions)
        power = along**2 / np.maximum((columns**2).sum(axis=0), 1e-300)
        by_name = {interval.name: interval for interval in self.intervals}
        order = [int(k) for k in np.argsort(-power) if power[k] >= ALONE * power.max()]
        found = [by_name[frees[k].name] for k in order]
        for one in found:
            one.tied_to = [other.name for other in found if other is not one]
        return found


def refit(bench: Bench, state: State, frees: Sequence[Free] | None = None) -> Refit:
    """Fit the base model's numbers to the training data.

    Args:
        bench: the measured series; their weights are set on the way.
        state: the base model.
        frees: numbers that may move; all that the base has when None.
    """
    known = all(predictor.plan.load == "output_torque" for predictor in bench.predictors)
    locked = all(predictor.plan.locked for predictor in bench.predictors)
    if frees is None:
        period = bench.predictors[0].record.period_s
        frees = base_freedoms(state, bench.channels, load_known=known, locked=locked, period_s=period)
    freedoms = list(frees)
    before = bench.predict(state)
    bench.weigh(bench.residuals(before))
    found = fit(bench, state, freedoms, evaluations=5, rough=True)
    align(bench, found)
    # Weights follow the residual: what the first fit explained no longer counts as noise.
    reweigh(bench, found)
    theta = {free.name: float(t) for free, t in zip(found.frees, found.theta, strict=True)}
    undetermined, ties = found.undetermined, found.ties
    slopes = found.columns, math.nan
    found = fit(bench, state, found.frees, theta=theta, prune=False, known=slopes)
    found.undetermined, found.ties = undetermined, ties
    align(bench, found)
    if undetermined and found.frees:
        unknown = Vector(found.state, tuple(undetermined), 0)
        found.beside = sensitivities(bench, unknown, unknown.start(), found.predictions), unknown.priors()
        rest = bench.stacked(bench.residuals(found.predictions))
        priors = np.array([free.prior for free in found.frees])
        found.covariance = robust_covariance(
            found.columns, rest, bench.stacked_blocks(), priors, found.beside
        )
    reweigh(bench, found)
    return Refit(found, freedoms, base_intervals(found, freedoms), before)


def align(bench: Bench, found: Fit) -> None:
    """Turn locked records to where the fitted model carries nothing."""
    if bench.align(found.state, found.predictions):
        found.predictions = bench.predict(found.state)


def reweigh(bench: Bench, found: Fit) -> None:
    """Set the weights from what a fit leaves, and its sensitivities with them."""
    old = np.array([series.sigma for series in bench.series])
    bench.weigh(bench.residuals(found.predictions))
    new = np.array([series.sigma for series in bench.series])
    change = (old / new)[bench.stacked_series()][:, None]
    if found.columns.size:
        found.columns *= change
    if found.beside is not None:
        found.beside = found.beside[0] * change, found.beside[1]
