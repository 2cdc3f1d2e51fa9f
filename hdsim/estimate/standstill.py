"""Where a measured motion does not tell which way a shaft turns, and so not its friction.

Coulomb friction at rest is whatever holds the shaft (Filippov 1988, Differential Equations with
Discontinuous Righthand Sides): no function of the motion, which is all that a prediction is given. Near rest
it is one as far as the speed is known. With Gaussian errors of standard deviation s the mean of sign(v) is
erf(v / (sqrt(2) s)), whose slope is that of tanh(v / (sqrt(pi / 2) s)); beyond 2 s the sign is certain.

A model that sticks may stand for a drive that does, or for one that creeps a little before it slips. The data
say which: the sharper sign is taken where it is clearly likelier while the shaft turns. A fit under the wrong
one bends friction to make up for it, so each is judged by the better of the fitted model and the one given.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

import numpy as np

from hdsim.drive.parameters import RESOLVED_RAD_PER_S, STICKS_RAD_PER_S
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import correlation
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import FEWEST_SAMPLES, Array, Mask
from hdsim.estimate.state import State

#: Standard deviations of a speed beyond which its sign is certain (95 %).
CERTAIN = 2.0
#: Smoothing speed of a sign over the standard deviation of the speed.
SMOOTHED = float(np.sqrt(np.pi / 2.0))
#: Samples on either side that count with one of unknown sign: where friction's jump can be seen, the motion's
#: spline has knots that many samples apart, and smooths the jump in acceleration over them.
BESIDE = 4
#: Log-likelihood by which the sharper sign must be the better one: "very strong" (Kass and Raftery 1995).
CLEARLY = 5.0


def hear_standstill(bench: Bench, models: Sequence[tuple[State, Sequence[Array]]]) -> bool:
    """Take the sign of friction as sharp as the speed is known, where that is clearly likelier.

    The motor's torque at rest counts no longer then.

    Args:
        bench: the measured series; predictors and masks are changed.
        models: the model at fitted numbers and as given, each with its predictions.

    Returns:
        Whether it was taken.
    """
    models = [
        (state, there)
        for state, there in models
        if state.drive.friction.sticks
        and max(state.drive.friction.coulomb_nm, state.drive.friction.load_coefficient) > 0.0
    ]
    if not models:
        return False
    kept = [predictor.smoothing for predictor in bench.predictors]
    for predictor in bench.predictors:
        predictor.smoothing = resolution(predictor.motor_velocity, predictor.speed_noise)
    turning = [
        ~standing(bench.predictors[s.record].motor_velocity, bench.predictors[s.record].smoothing)
        if s.channel == "motor_torque"
        else np.ones(len(s.train), dtype=bool)
        for s in bench.series
    ]
    if not _likelier(bench, models, turning):
        for predictor, smoothing in zip(bench.predictors, kept, strict=True):
            predictor.smoothing = smoothing
        return False
    for series, rows in zip(bench.series, turning, strict=True):
        # Of a record that hardly turns, what it has is better than nothing.
        if ((series.train | series.hold) & rows).sum() >= FEWEST_SAMPLES:
            series.train, series.hold = series.train & rows, series.hold & rows
    return True


def _likelier(bench: Bench, models: Sequence[tuple[State, Sequence[Array]]], turning: Sequence[Mask]) -> bool:
    """Whether the predictors' present sign explains the motor's torque clearly better than before."""
    smooth = [bench.residuals(there) for _, there in models]
    sharper = []
    for state, _ in models:
        with contextlib.suppress(PredictionError):
            sharper.append(bench.residuals(bench.predict(state)))
    if not sharper:
        return False

    def against(residuals: Sequence[Array]) -> float:
        """What the motor's torque has against a model, in units of an independent sample, halved."""
        total = 0.0
        for k, rows in turned:
            rest, like = residuals[k][rows], now[k][rows]
            independent = correlation(like, bench.series[k].block[rows])
            total += (
                0.5
                * float(np.sum(rest**2))
                / independent
                / max(float(np.mean(like**2)), bench.series[k].noise ** 2)
            )
        return total

    turned = [
        (k, s.train & rows)
        for k, (s, rows) in enumerate(zip(bench.series, turning, strict=True))
        if s.channel == "motor_torque" and s.record < bench.training and (s.train & rows).any()
    ]
    now = min(
        sharper, key=lambda residuals: sum(float(np.sum(residuals[k][rows] ** 2)) for k, rows in turned)
    )
    return min(against(residuals) for residuals in smooth) - against(now) > CLEARLY


def resolution(speed: Array, noise: float) -> float:
    """Smoothing speed of the sign of a measured speed, rad/s; at most that of the effects' own formulas.

    A speed is known no better than its noise, nor than what it changes by between two samples.

    Args:
        speed: shape (n,), rad/s.
        noise: its standard deviation, rad/s.
    """
    between = float(np.median(np.abs(np.diff(speed))))
    return float(np.clip(SMOOTHED * np.hypot(noise, between), STICKS_RAD_PER_S, RESOLVED_RAD_PER_S))


def standing(speed: Array, smoothing: float) -> Mask:
    """Samples at which the shaft may rest or reverse, and those next to them, shape (n,).

    Args:
        speed: shape (n,), rad/s.
        smoothing: of the sign, ``resolution``, rad/s.
    """
    slow = np.abs(speed) < CERTAIN / SMOOTHED * smoothing
    turned = np.diff(np.sign(speed)) != 0
    slow[1:] |= turned
    slow[:-1] |= turned
    return np.convolve(slow, np.ones(2 * BESIDE + 1), "same") > 0
