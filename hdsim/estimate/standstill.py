"""Where a measured motion does not tell which way a shaft turns, and so not its friction.

Coulomb friction at rest is whatever holds the shaft (Filippov 1988, Differential Equations with
Discontinuous Righthand Sides): no function of the motion, which is all that a prediction is given. Near rest
it is one as far as the speed is known. With Gaussian errors of standard deviation s the mean of sign(v) is
erf(v / (sqrt(2) s)), whose slope is that of tanh(v / (sqrt(pi / 2) s)); beyond 2 s the sign is certain.

A model that sticks may stand for a drive that does, or for one that creeps a little before it slips. The data
say which: the sharper sign is taken where it is clearly likelier while the shaft turns. A fit under the
wrong one bends friction to make up for it, so each is judged by a fit of its own.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.parameters import RESOLVED_RAD_PER_S, STICKS_RAD_PER_S
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import correlation
from hdsim.estimate.fit import Fit, at_present
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import FEWEST_SAMPLES, Array, Mask
from hdsim.estimate.series import Counted
from hdsim.estimate.state import State
from hdsim.estimate.vector import Vector, sensitivities
from hdsim.log.outliers import runs_of

if TYPE_CHECKING:
    from hdsim.estimate.predict import Predictor

#: Standard deviations of a speed beyond which its sign is certain (95 %).
CERTAIN = 2.0
#: Standard deviations of an angle's noise that a way must have to be one (chance: 6 in 100,000).
SEEN = 4.0
#: Smoothing speed of a sign over the standard deviation of the speed.
SMOOTHED = float(np.sqrt(np.pi / 2.0))
#: Samples on either side that count with one of unknown sign: where friction's jump can be seen, the motion's
#: spline has knots that many samples apart, and smooths the jump in acceleration over them.
BESIDE = 4
#: Smoothing speeds of a sign that are tried are apart by the square root of this factor, or less.
CREEPS = 3.0
#: Log-likelihood by which the sharper sign must be the better one: "very strong" (Kass and Raftery 1995).
CLEARLY = 5.0


def hear_standstill(
    bench: Bench,
    given: State,
    before: Sequence[Array],
    found: Fit,
    anew: Callable[[], Fit],
    carried_on: Callable[[Fit], Fit] | None = None,
) -> Fit:
    """Take the sign of friction as sharp as the speed is known, where that is clearly likelier.

    The motor's torque at rest counts no longer then.

    Args:
        bench: the measured series, weighed; predictors and masks are changed.
        given: the model as given.
        before: its predictions.
        found: the model fitted.
        anew: makes a fit like that under the sharper sign.
        carried_on: carries a fit on to its end; None for a first look at fits that are on their way, of which
            the nearer one seems likelier. A second look needs a reason: torque that is missed at rest.

    Returns:
        The fit under the sign that was taken.
    """
    if not given.drive.friction.sticks or not has_a_sign(given):
        return found
    signs = [predictor.smoothing for predictor in bench.predictors]
    sharp = [resolution(predictor.speed_noise) for predictor in bench.predictors]
    if signs == sharp:
        return found
    counted = Counted(bench.series)

    def take(smoothing: Sequence[float]) -> None:
        for predictor, speed in zip(bench.predictors, smoothing, strict=True):
            predictor.smoothing = speed

    def end_of(fit: Fit) -> Fit:
        return fit if carried_on is None else carried_on(fit)

    turning = while_turning(bench)
    with contextlib.suppress(PredictionError):
        # A first look needs no reason; what is asked of the found fit costs no prediction.
        asked = carried_on is None or missed_at_rest(bench, found.predictions, turning)
        if asked:
            take(sharp)
            asked = _matters(bench, before, bench.predict(given), turning)
            take(signs)
        if asked:
            count_only(bench, turning)
            # Both are carried on with the same samples.
            smooth = end_of(found)
            take(sharp)
            sharper = end_of(anew())
            better = _likelier(bench, smooth.predictions, sharper.predictions)

            def sign(speed: float) -> None:
                take([max(speed, own) for own in sharp])

            ends = (min(sharp), max(signs)) if better else (max(signs), min(sharp))
            between = _creeping(bench, sharper if better else smooth, ends, sign, lambda: end_of(anew()))
            if between is not None:
                return between
            if better:
                take(sharp)
                return sharper
    take(signs)
    counted.put_back()
    return found


def _creeping(
    bench: Bench,
    best: Fit,
    ends: tuple[float, float],
    sign: Callable[[float], None],
    anew: Callable[[], Fit],
) -> Fit | None:
    """The fit under a sign between two, where it explains most of what the better one leaves.

    A shaft may creep a little before it slips. A law of friction that is missing leaves more than that.

    Args:
        bench: the measured series, weighed.
        best: the fit under the better sign.
        ends: smoothing speeds of that sign and of the other one, rad/s.
        sign: takes the sign of a smoothing speed.
        anew: makes a fit under the sign that is taken.
    """
    noise, first = bench.noise_power, bench.power(best.predictions)
    if first <= noise:
        return None
    enough = noise + 0.5 * (first - noise)
    sign(ends[0])
    vector = Vector(best.state, tuple(at_present(best)), len(best.state.added))
    columns = sensitivities(bench, vector, vector.start(), best.predictions)
    columns = np.hstack([columns, bench.offset_columns()])

    def left(speed: float) -> float:
        """What is left of the power under a sign once the numbers have made up for it, as far as they can."""
        sign(speed)
        rest = bench.stacked(bench.residuals(bench.predict(best.state)))
        moves, *_ = np.linalg.lstsq(columns, rest, rcond=1e-6)
        return float(np.sum((rest - columns @ moves) ** 2))

    with contextlib.suppress(PredictionError):
        count = math.ceil(abs(math.log(ends[1] / ends[0])) / math.log(CREEPS))
        tried = {speed: left(speed) for speed in np.geomspace(*ends, 2 * count + 1)[1:-1].tolist()}
        speed = min(tried, key=tried.__getitem__, default=0.0)
        # The numbers may go on from there.
        if not tried or tried[speed] > noise + 0.9 * (first - noise):
            return None
        tried |= {near: left(near) for near in (speed * CREEPS**-0.25, speed * CREEPS**0.25)}
        sign(min(tried, key=tried.__getitem__))
        found = anew()
        if _likelier(bench, best.predictions, found.predictions) and bench.power(found.predictions) < enough:
            return found
    return None


def has_a_sign(state: State) -> bool:
    """Whether a drive's own friction jumps where its motor turns round."""
    return bool(max(state.drive.friction.coulomb_nm, state.drive.friction.load_coefficient) > 0.0)


def leave_out_rest(bench: Bench, found: Fit) -> bool:
    """Leave out the motor's torque at rest where a base without friction misses it more than while it turns.

    There is no sign to be taken sharper (``hear_standstill``), and friction that is named as an effect would
    be asked for what no function of the motion is. Rest is what its formula takes for that, whose sign is
    smoothed over ``RESOLVED_RAD_PER_S``.

    Args:
        bench: the measured series, weighed; masks are changed.
        found: the model with the effects that were found.

    Returns:
        Whether something was left out.
    """
    turning = while_turning(bench, RESOLVED_RAD_PER_S)
    return missed_at_rest(bench, found.predictions, turning) and count_only(bench, turning)


def while_turning(bench: Bench, least: float = 0.0) -> list[Mask]:
    """Samples of each series that a shaft at rest has no part in, shape (n,) each; ``least`` as there."""
    return [
        ~at_rest(bench.predictors[s.record], least)
        if s.channel == "motor_torque"
        else np.ones(len(s.train), dtype=bool)
        for s in bench.series
    ]


def count_only(bench: Bench, turning: Sequence[Mask]) -> bool:
    """Only samples while the shaft turns count; whether that leaves out any."""
    changed = False
    for series, rows in zip(bench.series, turning, strict=True):
        counted = series.train | series.hold
        # Of a record that hardly turns, what it has is better than nothing.
        if (counted & rows).sum() >= FEWEST_SAMPLES:
            changed = changed or bool((counted & ~rows).any())
            series.train, series.hold = series.train & rows, series.hold & rows
    return changed


def _matters(bench: Bench, before: Sequence[Array], now: Sequence[Array], turning: Sequence[Mask]) -> bool:
    """Whether the sharper sign changes the motor's torque by enough to be seen, while the shaft turns."""
    seen = 0.0
    for series, one, other, rows in zip(bench.series, before, now, turning, strict=True):
        if series.channel == "motor_torque" and len(other) and series.noise > 0:
            seen += 0.5 * float(np.sum(((other - one)[series.train & rows] / series.noise) ** 2))
    return seen > CLEARLY


def _likelier(bench: Bench, smooth: Sequence[Array], sharp: Sequence[Array]) -> bool:
    """Whether the sharper sign explains the motor's torque clearly better, where that counts."""
    better = 0.0
    for series, before, now in zip(
        bench.series, bench.residuals(smooth), bench.residuals(sharp), strict=True
    ):
        rows = series.train
        if series.channel != "motor_torque" or not len(now) or not rows.any():
            continue
        before, now = before[rows], now[rows]
        independent = correlation(now, series.block[rows]) * max(float(np.mean(now**2)), series.noise**2)
        better += 0.5 * (float(np.sum(before**2)) - float(np.sum(now**2))) / independent
    return better > CLEARLY


def missed_at_rest(bench: Bench, smooth: Sequence[Array], turning: Sequence[Mask]) -> bool:
    """Whether the motor's torque is clearly missed more at rest than while the shaft turns.

    Log-likelihood of two variances against one (Gaussian likelihood ratio), for as many independent samples
    as there are at rest. What is missing while the shaft turns is missing at rest as well, and says nothing.
    """
    better = 0.0
    for series, left, rows in zip(bench.series, bench.residuals(smooth), turning, strict=True):
        turned, rest = series.train & rows, series.train & ~rows
        if series.channel != "motor_torque" or not len(left) or not (turned.any() and rest.any()):
            continue
        usual = max(float(np.mean(left[turned] ** 2)), series.noise**2)
        more = float(np.mean(left[rest] ** 2)) / usual
        independent = rest.sum() / correlation(left[rest], series.block[rest])
        if more > 1.0:
            better += 0.5 * independent * (more - 1.0 - math.log(more))
    return bool(better > CLEARLY)


def resolution(noise: float) -> float:
    """Smoothing speed of the sign of a speed, rad/s; at most that of the effects' own formulas.

    What the speed changes by between two samples does not count: near a reversal no sample does (``BESIDE``).

    Args:
        noise: standard deviation of the speed, rad/s.
    """
    return float(np.clip(SMOOTHED * noise, STICKS_RAD_PER_S, RESOLVED_RAD_PER_S))


def at_rest(predictor: Predictor, least: float = 0.0) -> Mask:
    """Samples of a record at which its motor may rest or reverse, and those next to them, shape (n,).

    Args:
        predictor: of the record.
        least: smoothing speed of a sign that is no sharper, however well the speed is known, rad/s.
    """
    speed = predictor.motor_velocity
    smoothing = max(resolution(predictor.speed_noise), least)
    return standing(speed, smoothing, predictor.motor_angle, SEEN * predictor.angle_noise)


def standing(speed: Array, smoothing: float, angle: Array | None = None, least_rad: float = 0.0) -> Mask:
    """Samples at which the shaft may rest or reverse, and those next to them, shape (n,).

    Of a long rest a few samples seem fast by chance, and a spline swings before the jump in speed that ends
    it, by as much as the readings' noise allows. Between two slow ones the shaft has turned where it has come
    farther than that.

    Args:
        speed: shape (n,), rad/s.
        smoothing: of the sign, ``resolution``, rad/s.
        angle: of the shaft, shape (n,), rad.
        least_rad: least way of a turn.
    """
    slow = np.abs(speed) < CERTAIN / SMOOTHED * smoothing
    turned = np.diff(np.sign(speed)) != 0
    slow[1:] |= turned
    slow[:-1] |= turned
    if angle is not None:
        for first, end in runs_of(~slow):
            # From the slow sample before to the one behind.
            if abs(angle[min(end, len(angle) - 1)] - angle[max(first - 1, 0)]) < least_rad:
                slow[first:end] = True
    return np.convolve(slow, np.ones(2 * BESIDE + 1), "same") > 0
