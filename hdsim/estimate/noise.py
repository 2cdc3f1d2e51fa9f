"""Noise of a measured channel: white noise from differences, and the steps of a quantised sensor.

White noise of standard deviation s has k-th differences of standard deviation s sqrt(C(2k, k)), which a
signal much slower than the sampling leaves near zero (Rice 1984, Annals of Statistics 12:1215,
difference-based estimators). The more slowly a record is sampled, the higher the order that is needed: the
smallest of several orders is taken, as a signal can only add to each of them.

A quantised reading cannot be known better than its step q allows: its error is uniform over the step, with
standard deviation q / sqrt(12) (Widrow and Kollar 2008, Quantization Noise, ch. 5), even where the signal
stands still within one step and all differences are zero.

A ripple of the motor's turn near half the sample rate is quicker than any difference can leave out. It
repeats with the angle, which noise does not, and is taken out first (``without_orders``).
"""

from __future__ import annotations

import math

import numpy as np

from hdsim.estimate.records import Array, Mask, Record

#: Orders of differences; beyond 8 they weigh only the highest frequencies.
ORDERS = (4, 6, 8)
#: Part of a step by which differences of a quantised channel may miss its multiples: rounding in a text file.
ROUNDING = 0.05
#: Orders of a turn that may be quick, and the part of a channel's differences that one must be to be there:
#: of 200 samples of noise 3 in 100,000 have so much of an order by chance.
QUICK, PART, FEWEST = range(1, 33), 0.1, 200
#: Least turns: over less an order is no frequency.
TURNS = 2.0
#: Parts of the largest reading below which two are one: rounding in double and in single precision.
ROUNDED = (1e-12, 2e-7)


def noise_floor(values: Array, trusted: Mask) -> float:
    """Standard deviation of a channel's noise, with that of its quantisation, in its unit (0: none).

    Args:
        values: shape (n,).
        trusted: shape (n,), samples that count.
    """
    return max(white_noise(values, trusted), quantisation_step(values[trusted]) / math.sqrt(12.0))


def step_of_means(values: Array, trusted: Mask, step: float, means: Array, readings: int) -> float:
    """Step whose q / sqrt(12) is what a sensor's steps leave on means of successive readings, in their unit.

    Errors of readings are apart where noise or motion takes each to a step of its own; the readings of a mean
    that stay within one step err alike.

    Args:
        values: shape (n,), as read.
        trusted: shape (n,), samples that count.
        step: of the sensor.
        means: shape (m,).
        readings: of a mean.
    """
    if step == 0.0 or readings == 1:
        return step
    dithered = white_noise(values, trusted) >= step / math.sqrt(12.0)
    if dithered:
        return step / math.sqrt(readings)
    crossed = np.clip(np.abs(np.diff(means)) / step, 1.0, readings)
    return step * math.sqrt(float(np.mean(1.0 / crossed)))


def noise_of_means(
    values: Array, trusted: Mask, step: float, means: Array, whole: Mask, readings: int
) -> float:
    """Standard deviation of the noise on means of successive readings, in their unit.

    White noise falls with the root of their number; noise that is not white by less, as differences of the
    means tell, and none rises.

    Args:
        values: shape (n,), as read.
        trusted: shape (n,), readings that count.
        step: of the sensor.
        means: shape (m,).
        whole: shape (m,), means that count.
        readings: of a mean.
    """
    white = white_noise(values, trusted)
    single = max(white, step / math.sqrt(12.0))
    if readings == 1:
        return single
    steps = step_of_means(values, trusted, step, means, readings) / math.sqrt(12.0)
    least = min(max(white / math.sqrt(readings), steps), single)
    return min(max(white_noise(means, whole), least), single)


def quantisation_step(values: Array) -> float:
    """Step q of which all differences between readings are multiples, in their unit; 0 where there is none.

    Readings of one step may differ by what single precision, or a conversion of their unit, rounds.

    Args:
        values: shape (n,), trusted readings.
    """
    gaps = np.diff(np.unique(values))
    for rounded in ROUNDED:
        step = _step(gaps[gaps > rounded * float(np.max(np.abs(values), initial=0.0))])
        if step > 0.0:
            return step
    return 0.0


def step_of(record: Record, channel: str) -> float:
    """Step of a channel's sensor: that of its readings, however many a sample is the mean of."""
    raw = record.as_read
    return quantisation_step(raw.channels[channel][raw.trusted[channel]])


def _step(steps: Array) -> float:
    if len(steps) < 2:
        return 0.0
    # The median of the smallest ones: a single one may have lost digits.
    smallest = float(steps.min())
    step = float(np.median(steps[steps < 1.5 * smallest]))
    multiples = steps / step
    missed = np.abs(multiples - np.round(multiples))
    return step if float(np.quantile(missed, 0.99)) < ROUNDING else 0.0


def white_noise(values: Array, trusted: Mask) -> float:
    """Standard deviation of the white noise on a channel (robust; 0 when there is none)."""
    found = []
    marked = np.where(trusted, values, np.nan)
    for order in ORDERS:
        differences = np.diff(marked, order)
        differences = differences[np.isfinite(differences)]
        if len(differences) < 10:
            break
        found.append(usual_size(differences) / math.sqrt(math.comb(2 * order, order)))
    return min(found, default=0.0)


def without_orders(values: Array, trusted: Mask, angle: Array) -> Array:
    """A channel without quick waves over an angle, one of which alone would count as noise, shape (n,).

    Least squares of the differences, which have nothing slow, on those of sine and cosine of each order.

    Args:
        values: shape (n,).
        trusted: shape (n,), samples that count.
        angle: of the shaft whose turn has the orders, shape (n,), rad.
    """
    found = np.array(values, dtype=float)
    order = ORDERS[0]
    left = np.diff(np.where(trusted, found, np.nan), order)
    rows = np.isfinite(left)
    if rows.sum() < FEWEST or np.ptp(angle) < TURNS * 2.0 * np.pi:
        return found
    left = left[rows] - left[rows].mean()
    for k in QUICK:
        waves = np.column_stack([np.cos(k * angle), np.sin(k * angle)])
        columns = np.diff(waves, order, axis=0)[rows]
        size, *_ = np.linalg.lstsq(columns, left, rcond=1e-9)
        rest = left - columns @ size
        if rest @ rest < (1.0 - PART) * (left @ left):
            left, found = rest, found - waves @ size
    return found


def usual_size(values: Array) -> float:
    """Standard deviation about zero of a normal distribution with the same median size, in their unit.

    Args:
        values: shape (n,); few large ones do not count.
    """
    # 0.6745: the median of |x| of a standard normal.
    return float(np.median(np.abs(values))) / 0.6745
