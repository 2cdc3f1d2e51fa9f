"""The drive's own coordinates along a record, and columns of curves over them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.bench import Bench
from hdsim.estimate.records import Array
from hdsim.estimate.series import Series

#: Oscillators that stand for parts that ring: number, damping ratio (neighbours overlap), least frequency.
OSCILLATORS, DAMPING_RATIO, SLOWEST_HZ = 12, 0.2, 0.5
#: Highest frequency of an oscillator as a part of the sampling rate.
FASTEST = 0.3


def coordinates(bench: Bench, series: Series, residuals: Sequence[Array]) -> dict[str, Array]:
    """The coordinates of one series at all its samples, shape (n,) each.

    Args:
        bench: the measured series.
        series: the one that is asked for.
        residuals: of all series; they say what torque the model has.
    """
    predictor = bench.predictors[series.record]
    record = predictor.record
    velocity = predictor.motor_velocity
    direction = _direction(velocity)
    since = _since_reversal(record.time, direction)
    found = {
        "time": record.time,
        "velocity": velocity,
        "direction": direction,
        "time_since_reversal": direction * np.log1p(since / 0.02),
        "output_angle": predictor.motor_angle / predictor.ratio,
    }
    for other, residual in zip(bench.series, residuals, strict=True):
        if other.record == series.record and other.channel == "motor_torque":
            found["motor_torque"] = other.measured - residual
    torque = _model_torque(bench, series, residuals)
    if torque is not None:
        found["torque"] = torque
    if "temperature" in record.channels and record.trusted["temperature"].sum() > 20:
        found["temperature"] = record.filled("temperature")
    return found


def _model_torque(bench: Bench, series: Series, residuals: Sequence[Array]) -> Array | None:
    """Torque at the output as the model has it: the measured one would hold the residual itself."""
    for other, residual in zip(bench.series, residuals, strict=True):
        if other.record == series.record and other.channel == "output_torque":
            return np.asarray(other.measured - residual)
    predictor = bench.predictors[series.record]
    if predictor.plan.load != "scenario":
        return _smooth(predictor.record.filled(predictor.plan.load))
    return None


def oscillators(bench: Bench, series: Series) -> Array:
    """What oscillators of several frequencies do when the motion shakes them, shape (n, 2 OSCILLATORS).

    x'' + 2 d w x' + w^2 x = -a with the motor's acceleration a: a part that hangs on the drive by a spring
    leaves a sum of such x and x' in torque and angle.
    """
    from scipy.signal import bilinear, lfilter

    predictor = bench.predictors[series.record]
    rate = 1.0 / predictor.record.period_s
    slowest = max(SLOWEST_HZ, 3.0 / predictor.record.duration_s)
    columns = []
    for frequency in np.geomspace(slowest, FASTEST * rate, OSCILLATORS):
        w = 2 * np.pi * frequency
        bottom = [1.0, 2.0 * DAMPING_RATIO * w, w * w]
        columns += [
            lfilter(*bilinear(top, bottom, rate), predictor.motor_acceleration)
            for top in ([0.0, 0.0, w * w], [0.0, w, 0.0])
        ]
    return np.column_stack(columns)


def hats(values: Array, corners: Array) -> Array:
    """Piecewise linear functions that are 1 at one corner and 0 at the others, shape (n, corners)."""
    columns = np.empty((len(values), len(corners)))
    for k in range(len(corners)):
        unit = np.zeros(len(corners))
        unit[k] = 1.0
        columns[:, k] = np.interp(values, corners, unit)
    return columns


def _direction(velocity: Array) -> Array:
    """Sign of the velocity; below a thousandth of the largest the last one."""
    small = np.abs(velocity) < 1e-3 * np.max(np.abs(velocity))
    sign = np.where(small, 0.0, np.sign(velocity))
    index = np.where(sign != 0, np.arange(len(sign)), 0)
    held: Array = sign[np.maximum.accumulate(index)]
    return held


def _since_reversal(time: Array, direction: Array) -> Array:
    turned: NDArray[np.bool_] = np.concatenate([[False], np.diff(direction) != 0])
    last = np.maximum.accumulate(np.where(turned, np.arange(len(time)), 0))
    return np.asarray(time - time[last])


def _smooth(values: Array, samples: int = 15) -> Array:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(values, samples, mode="nearest"))
