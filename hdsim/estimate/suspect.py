"""Suspicions that need the model: wrong scales, and logs of another drive, before either is sold as physics.

Kinematics tell a wrong unit only where two channels show the same motion (`hdsim.estimate.factors`). A torque
that stands alone is held against the model: its regression on the prediction gives one factor, and a factor
near 1000, 180/pi, the ratio or -1 has a likely cause. The re-fitted numbers are held against the range in
which a drive of the same size lies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.factors import explain, slope
from hdsim.estimate.numbers import Interval
from hdsim.estimate.offsets import DRIFT, ZEROS, offsets_of
from hdsim.estimate.predict import Predictor
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.refit import Refit
from hdsim.estimate.state import State

#: Factor between a measured channel and its prediction beyond which its unit is suspect. A number of the
#: model declares its own at its field; a fitted inertia is bent by friction that the model lacks, so its own
#: part of the torque is looked at instead.
FAR_CHANNEL = 4.0
#: Part of the fastest speed below which a motion in the other direction is none: what a spline rings.
SLOW = 0.02
#: Least delay that is told, samples.
LATE = 0.5
#: Share of a channel's variation that one factor must explain to be evidence, and how near a cause must be.
EXPLAINED, NEAR = 0.5, 0.25
#: The same for the part that follows the acceleration.
EXPLAINED_PART = 0.1
#: A re-fit tells something when it leaves less than this part of a gap; a channel is missed when this many
#: times its variation is left.
CLOSED, MISSED = 0.5, 3.0
#: A held-out record is another drive's when its gap is this many times that of the others, and this part of
#: what varies.
ANOTHER, PART = 5.0, 0.3


def suspicions(bench: Bench, base: Refit, start: State) -> list[Problem]:
    """Warnings about data that do not look like this drive's.

    Args:
        bench: the measured series.
        base: the re-fit.
        start: the model as given.
    """
    if bench.training < len(bench.predictors):
        before, after = (bench.predict(state, everything=True) for state in (start, base.fit.state))
    else:
        before, after = base.before, base.fit.predictions
    scales = _scales(bench, before)
    return [*scales, *_numbers(bench, base, after, scales), *_other_holdouts(bench, after)]


def delays(bench: Bench, intervals: Sequence[Interval]) -> list[Problem]:
    """Torques that the log stamps late or early beside the motion, by half a sample or more.

    Args:
        bench: the measured series.
        intervals: fitted numbers, those of the delays among them.
    """
    record = bench.predictors[0].record.as_read
    found = []
    for one in intervals:
        if not (one.delay_of and one.determined) or one.low <= 0.0 <= one.high:
            continue
        if abs(one.value) < LATE * record.period_s:
            continue
        side = "late" if one.value > 0 else "early"
        message = (
            f"is stamped {1e3 * abs(one.value):.2g} ms {side} beside the motion "
            f"({abs(one.value) / record.period_s:.2g} samples; 95 % interval {1e3 * one.low:.2g} to "
            f"{1e3 * one.high:.2g} ms); the fits take that into account"
        )
        found.append(Problem(record.name, one.delay_of, "clock", "info", message))
    return found


def one_way(bench: Bench) -> list[Problem]:
    """Torques that are compared along motions in one direction only.

    Friction that does not change with speed and the sensor's zero are then one number (and a fit leaves them
    where they are).

    Args:
        bench: the measured series.
    """
    speeds = [p.motor_velocity for p in bench.predictors[: bench.training]]
    fastest = max(float(np.max(np.abs(speed))) for speed in speeds)
    back, ahead = (any(np.any(sign * s > SLOW * fastest) for s in speeds) for sign in (-1.0, 1.0))
    if back == ahead or bench.zeros == "trusted":
        return []
    return [
        Problem(
            bench.predictors[0].record.name,
            channel,
            "one way",
            "info",
            "the motion goes one way: Coulomb friction and the sensor's zero are confounded in these data",
        )
        for channel in bench.channels
        if channel.endswith("torque")
    ]


def moving_zeros(bench: Bench, predictions: Sequence[Array]) -> list[Problem]:
    """Torques of which little more than a constant of its own is left in each record.

    Args:
        bench: the measured series.
        predictions: of the training records, by the final model.
    """
    found: list[Problem] = []
    if bench.zeros != "campaign":
        return found
    together, apart = (
        offsets_of(bench.series, bench.apart(predictions), zeros, drift=False) for zeros in ZEROS
    )
    for channel in bench.channels:
        own = [k for k, s in enumerate(bench.series) if s.channel == channel and s.record < bench.training]
        moved = {k: apart[k] - together[k] for k in own}
        far = [k for k in own if abs(moved[k]) > DRIFT * bench.series[k].noise]
        count = np.array([bench.series[k].train.sum() for k in own], dtype=float)
        rest = bench.residuals(predictions)
        left = np.array([np.sum(rest[k][bench.series[k].train] ** 2) for k in own])
        floor = float(count @ np.array([bench.series[k].noise ** 2 for k in own]))
        if far and count @ np.array([moved[k] ** 2 for k in own]) > CLOSED * (float(left.sum()) - floor):
            words = ", ".join(
                f"{moved[k]:+.3g} in {bench.predictors[bench.series[k].record].record.name}" for k in far[:3]
            )
            message = (
                f"most of the residual is a different constant in each record ({words}): if the sensor was "
                "zeroed between them, give --zeros record"
            )
            name = bench.predictors[bench.series[far[0]].record].record.name
            found.append(Problem(name, channel, "zero", "warning", message))
    return found


def _scales(bench: Bench, before: list[Array]) -> list[Problem]:
    """Torques that are the model's prediction, or its inertia's part, times a factor that is far from 1."""
    found = []
    for series, predicted in zip(bench.series, before, strict=True):
        predictor = bench.predictors[series.record]
        rows = series.train | series.hold
        if not len(predicted) or series.channel == "output_angle" or rows.sum() < 20:
            continue
        whole = slope(predicted[rows], series.measured[rows])
        part = _inertia(predictor, rows, series.measured, predicted)
        for what, (factor, explained), least in (
            ("what the model predicts", whole, EXPLAINED),
            ("the part of the model's prediction that follows the acceleration", part, EXPLAINED_PART),
        ):
            if explained < least or 1.0 / FAR_CHANNEL < factor < FAR_CHANNEL:
                continue
            kind, text = explain(factor, predictor.ratio, NEAR) or ("unit", "in a wrong unit")
            message = (
                f"is {float(f'{factor:.3g}'):g} times {what} (this explains {100 * explained:.0f} % of its "
                f"variation), as if it, its motion or its load were {text}"
            )
            found.append(Problem(predictor.record.name, series.channel, kind, "warning", message))
            break
    return found


def _inertia(predictor: Predictor, rows: Mask, measured: Array, predicted: Array) -> tuple[float, float]:
    """Ratio of the inertias that a measured and a predicted torque show, and the measured one's share.

    Both are regressed on acceleration, velocity, its sign and gravity's sine and cosine.
    """
    turned = predictor.motor_angle[rows] / predictor.ratio
    velocity = predictor.motor_velocity[rows]
    others = [velocity, np.sign(velocity), np.cos(turned), np.sin(turned), np.ones_like(velocity)]
    q, _ = np.linalg.qr(np.column_stack(others))
    acceleration = predictor.motor_acceleration[rows]
    alone = acceleration - q @ (q.T @ acceleration)
    power, variation = float(alone @ alone), float(np.sum((measured[rows] - measured[rows].mean()) ** 2))
    ours, theirs = float(alone @ measured[rows]), float(alone @ predicted[rows])
    if power <= 1e-9 * float(acceleration @ acceleration) or variation == 0.0 or theirs == 0.0:
        return math.nan, 0.0
    return ours / theirs, ours**2 / power / variation


def _numbers(bench: Bench, base: Refit, after: list[Array], scales: list[Problem]) -> list[Problem]:
    """Fitted numbers far from the model's, and channels that the re-fitted model misses altogether."""
    if scales:
        return []  # numbers fitted to a torque on another scale only follow it
    closed, worse = False, []
    for series, first, last in zip(bench.series, base.before, after, strict=True):
        if not series.train.any():
            continue
        rests = [float(np.std((series.measured - values)[series.train])) for values in (first, last)]
        varies = float(np.std(series.measured[series.train]))
        closed |= rests[1] < CLOSED * rests[0]
        # An angle's variation is mostly the ratio's, which the check has looked at.
        if series.channel != "output_angle" and rests[1] > MISSED * varies:
            worse.append(f"{series.channel} is missed by {rests[1] / varies:.2g} times its own variation")
    far = []
    for k, (free, away) in enumerate(zip(base.fit.frees, base.fit.theta, strict=True)):
        theta = float(away) - free.given  # from the model's own number, wherever the fit began
        if free.delay_of:
            continue  # a delay has no scale to be far from
        limit = math.log(free.far)
        # A number that closes no gap has only been bent by something that is missing; friction and
        # damping may be nothing.
        least = math.inf if free.may_vanish else limit
        # What its interval still reaches, the data do not contradict.
        wide = 2.0 * math.sqrt(base.fit.covariance[k, k])
        if closed and not -least - wide <= theta <= limit + wide:
            bound = ", the bound of the search" if abs(theta) > 2.99 else ""
            far.append(f"{free.name} is {math.exp(theta):.3g} times the model's{bound}")
    if not far and not worse:
        return []
    listed = "; ".join([*far, *worse])
    message = f"after the re-fit {listed}: a log of another drive or load, or a wrong unit"
    record = bench.predictors[0].record.name
    return [Problem(record, "model", "drive", "warning", message)]


def _other_holdouts(bench: Bench, after: list[Array]) -> list[Problem]:
    """Held-out records that the model fitted to the others misses by far more than those."""
    found = []
    rests: dict[str, float] = {}
    for series, predicted in zip(bench.series, after, strict=True):
        own = series.record >= bench.training
        rows = series.hold if own else series.train
        if not len(predicted) or not rows.any():
            continue
        rest = float(np.std((series.measured - predicted)[rows]))
        if not own:
            rests[series.channel] = max(rest, rests.get(series.channel, 0.0))
            continue
        predictor = bench.predictors[series.record]
        values = series.measured
        if series.channel == "output_angle":
            values = values - predictor.motor_angle / predictor.ratio
        varies = float(np.std(values[rows]))
        others = max(rests.get(series.channel, math.inf), series.noise)
        if rest > ANOTHER * others and rest > PART * varies:
            message = (
                f"the re-fitted model misses it by {rest:.3g}, {rest / others:.2g} times as much as the "
                "records that it was fitted to: a holdout of another drive or load"
            )
            found.append(Problem(predictor.record.name, series.channel, "drive", "warning", message))
    return found
