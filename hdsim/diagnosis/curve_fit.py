"""A curve's values: its corners' unit curves as columns, and the penalised least squares that solve for them.

Each corner's unit curve is simulated once in the re-fitted model; its change of all channels is a column.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.diagnosis.curve_kinds import Kind, sign_of, values_of
from hdsim.diagnosis.penalised import UNSEEN, Penalised
from hdsim.diagnosis.screen import Residual
from hdsim.effects._fitting import Amplitude, Fitting
from hdsim.effects.table import cells
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.numbers import scaled
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added, State
from hdsim.estimate.vector import COEFFICIENT_PRIOR

#: Points of the fine curve that says where corners are needed, and where a curve is most of the way.
FINE = 80


def effect(state: State, kind: Kind, at: Array) -> Added:
    """A curve as an effect with one coefficient for each corner, all 0."""
    blank = kind.curve(at, np.zeros(len(at))).model_dump(
        mode="json", exclude_none=True, exclude_defaults=True
    )
    field = "values_rad" if kind.acts_on == "mesh_angle" else "values_nm"
    unit = unit_of(state, kind)
    terms = tuple(Amplitude({f"curves.0.{field}.{k}": unit}, signed=True) for k in range(len(at)))
    return Added("table", Fitting(terms, settings={"curves": [blank]}), (0.0,) * len(at))


def unit_traces(
    bench: Bench, fit: Fit, kind: Kind, at: Array, added: Added, residuals: Sequence[Array]
) -> Array | None:
    """Change of the whitened predictions for every coefficient at 1 alone, shape (rows, k).

    The motor's motion is prescribed, so a torque on the motor is found again in the torque that holds it
    there, with the opposite sign, and nowhere else: that needs no simulation.
    """
    unit = unit_of(fit.state, kind)
    if kind.acts_on == "motor_torque":
        whole = np.zeros((len(bench.stacked_series()), len(at)))
        row = 0
        for k, series in enumerate(bench.series):
            if series.record >= bench.training:
                continue
            count = int(series.train.sum())
            if series.channel == "motor_torque" and count:
                x = values_of(bench, fit.state, kind, k, residuals)
                if x is None:
                    return None
                basis = -unit * _basis(at, kind.period, x)
                if kind.times_direction:
                    basis *= sign_of(bench, series)[:, None]
                time = bench.predictors[series.record].record.time
                change = fit.state.reading(series.channel, time, basis)[series.train]
                whole[row : row + count] = (change - change.mean(axis=0)) / series.sigma
            row += count
        return whole
    states = []
    for k in range(len(at)):
        one = tuple(1.0 if j == k else 0.0 for j in range(len(at)))
        states.append(replace(fit.state, added=(*fit.state.added, replace(added, coefficients=one))))
    found = bench.predict_all(states)
    columns = [bench.trace(fit.predictions, there) for there in found if there is not None]
    return np.column_stack(columns) if len(columns) == len(found) else None


def unit_of(state: State, kind: Kind) -> float:
    """Value at coefficient 1: a hundredth of the rated torque, or 2 arcsec."""
    if kind.acts_on == "mesh_angle":
        return 1e-5
    rated = 0.01 * float(state.drive.rated_torque_nm)
    return rated / abs(state.drive.ratio) if kind.acts_on == "motor_torque" else rated


def _basis(at: Array, period: float | None, x: Array) -> Array:
    """The unit curves of the table at values of the coordinate, shape (n, corners)."""
    count = len(at)
    columns = np.empty((len(x), count))
    for k in range(count):
        unit = tuple(1.0 if j == k else 0.0 for j in range(count))
        edges, packed = cells(tuple(at.tolist()), unit, period)
        numbers = np.array(packed).reshape(-1, 5)
        inside = x if period is None else edges[0] + np.mod(x - edges[0], period)
        inside = np.clip(inside, edges[0], edges[-1])
        cell = np.clip(np.searchsorted(edges, inside, side="right") - 1, 0, len(numbers) - 1)
        s = inside - np.array(edges)[cell]
        c0, c1, c2, c3 = numbers[cell, :4].T
        columns[:, k] = c0 + s * (c1 + s * (c2 + s * c3))
    return columns


def solved(
    bench: Bench, fit: Fit, left: Residual, at: Array, added: Added, columns: Array, found: Penalised
) -> tuple[Fit, Array] | None:
    """The model with the curve, and the standard deviations of its coefficients, shape (k,).

    None where it leaves more than the model without, or no prediction follows.

    The traces stay those of the start (a chord method): a second step takes up what is not linear in them.
    The variances are the sum of two: that of the Bayesian view of the penalty, which covers the smoothing's
    bias (Nychka 1988, J. American Statistical Association 83:1134), and the cluster-robust one over blocks of
    time, which covers residuals that are correlated.

    Args:
        bench: the measured series.
        fit: the fitted model without the curve.
        left: what it leaves, without what its own numbers and the sensors' offsets explain.
        at: corners, shape (k,), SI unit of the coordinate.
        added: the curve as an effect with one coefficient for each corner.
        columns: its ``unit_traces``, shape (rows, k).
        found: penalised least squares of ``left`` over them.
    """
    projected = left.project(columns)
    blocks = bench.stacked_blocks()
    right = projected.T @ left.values
    coefficients = np.zeros(columns.shape[1])
    level = projected.sum(axis=1)
    theta = np.zeros(len(fit.frees))
    chosen: tuple[State, list[Array], Array] | None = None
    rest = bench.stacked(bench.residuals(fit.predictions))
    least = float(rest @ rest)
    # Delays stay where they are: nothing bounds them here.
    moving = np.array([not free.step for free in fit.frees], dtype=float)
    own = np.hstack([fit.columns[:, : len(fit.frees)] * moving, bench.offset_columns()])
    # What the data hardly tell stays where priors have it.
    strict = np.array([1.0 / free.prior for free in fit.frees]) * math.sqrt(bench.sample_power(rest))
    priors = np.hstack([np.diag(strict), np.zeros((len(theta), own.shape[1] - len(theta)))])
    centre = np.array([free.none for free in fit.frees]) - fit.theta
    for _ in range(2):
        step = found.inverse @ (right - found.penalty @ coefficients)
        coefficients = coefficients + step
        if float(level @ level) < UNSEEN * float(np.trace(projected.T @ projected)):
            # Nobody can say where zero is: it is where the curve is most of the way.
            even = np.interp(np.linspace(at[0], at[-1], FINE), at, coefficients)
            coefficients = coefficients - np.median(even)
        # The model's own numbers take their part again.
        aim = np.concatenate([rest - columns @ step, strict * (centre - theta)])
        moved, *_ = np.linalg.lstsq(np.vstack([own, priors]), aim, rcond=1e-6)
        theta = theta + moved[: len(theta)]
        try:
            state = scaled(fit.state, fit.frees, theta.tolist())
            curve = replace(added, coefficients=tuple(coefficients.tolist()))
            state = replace(state, added=(*state.added, curve))
            predictions = bench.predict(state)
        except ArithmeticError:  # numbers so far off that no prediction follows from them
            break
        rest = bench.stacked(bench.residuals(predictions))
        loss = float(rest @ rest)
        if not loss < least:
            break
        least, chosen = loss, (state, predictions, theta)
        right = projected.T @ left.project(rest)
    if chosen is None:
        return None
    state, predictions, theta = chosen
    rest = bench.stacked(bench.residuals(predictions))
    used = np.unique(blocks)
    sums = np.array([(projected[blocks == b].T @ rest[blocks == b]) for b in used])
    meat = sums.T @ sums * len(used) / max(len(used) - columns.shape[1], 1)
    power = float(np.mean(rest**2))
    covariance = found.inverse @ meat @ found.inverse + power * found.inverse
    p = fit.covariance.shape[0]
    both = np.zeros((p + len(covariance), p + len(covariance)))
    both[:p, :p], both[p:, p:] = fit.covariance, covariance
    fitted = replace(
        fit,
        state=state,
        theta=fit.theta + theta,
        predictions=predictions,
        columns=np.hstack([fit.columns, columns]),
        covariance=both,
    )
    return fitted, np.minimum(np.sqrt(np.diag(covariance)), COEFFICIENT_PRIOR)
