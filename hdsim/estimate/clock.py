"""The clock of a sensor whose readings a log takes on a clock of its own.

A logger that is a little faster than the sensor finds no new reading every so often, and writes the old one
again: all channels of a row repeat those of the row before. One that hesitates loses a reading, over which
the angle goes as far as over two. Between such rows its stamps run away from the readings, by up to a period,
and come back at once: to a spline of the motion, and to its acceleration more so, that is a jerk. The
readings themselves were taken evenly. Their times are the shortest path over the readings' numbers on which
each lies before its stamp by no more than it can (taut string: Davies and Kovac 2001, Annals of Statistics
29:1): a straight line as long as the sensor's clock and the logger's can both be steady.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdsim.estimate.noise import noise_floor, quantisation_step
from hdsim.estimate.records import Array, Mask, Record
from hdsim.estimate.slips import STEPS
from hdsim.estimate.spikes import SPIKE_WINDOW, find_spikes
from hdsim.log.outliers import runs_of

#: Rows that may repeat by accident in a record, in expectation, for all to count that do.
BY_ACCIDENT = 0.05
#: Least part of their usual rate at which rows must repeat while the angle moves.
EVENLY = 0.5
#: Most rows in succession that repeat one reading: longer, everything is at rest, or nothing was sent.
LONGEST = 4
#: Periods by which a reading may be older than its stamp: its own, and one by which the logger was late.
OLDEST = 2.0


@dataclass(frozen=True)
class Clock:
    """When the readings of a record were taken.

    Attributes:
        time: of the rows that do not repeat, shape (m,), s, from 0, strictly increasing.
        repeated: shape (n,), rows that repeat the one before.
        lost: readings that were not logged.
    """

    time: Array
    repeated: Mask
    lost: int


def own_clock(record: Record) -> Clock | None:
    """When a record's readings were taken; None where no row repeats the one before."""
    angle = next((c for c in ("motor_angle", "output_angle") if c in record.readable), None)
    if angle is None:
        return None
    repeated = repeated_rows(record, angle)
    if not repeated.any():
        return None
    time, fresh = record.time, np.flatnonzero(~repeated)
    period = record.period_s
    ticks = np.maximum(np.round(np.diff(time[fresh], prepend=time[0] - period) / period), 1.0)
    # Past repeated rows the stamps have gone on, and the sensor has not.
    ticks = np.maximum(ticks - (np.diff(fresh, prepend=fresh[0] - 1) - 1), 1.0)
    steps = np.diff(record.filled(angle)[fresh], prepend=np.nan)
    steps[0] = steps[1]
    rates = steps / ticks
    way = _usual(rates)
    # The way of one more than its stamp says: a reading was lost there. A row that is missing says so itself.
    clear = np.abs(way) > STEPS * quantisation_step(record.channels[angle][record.trusted[angle]])
    lost = find_spikes(rates, np.ones(len(rates), dtype=bool)) & clear
    lost &= np.abs(steps - (ticks + 1.0) * way) < 0.5 * np.abs(way)
    number = np.cumsum(ticks + lost)
    taken = taut_string(number, time[fresh] - OLDEST * period, time[fresh])
    return Clock(taken - taken[0], repeated, int(lost.sum()))


def repeated_rows(record: Record, angle: str) -> Mask:
    """Rows in which every channel repeats the row before, and that is no accident: shape (n,).

    Either channels hardly ever repeat by themselves, so that all of them at once would not by chance, and
    they do in motion as often as at rest; or the angle stands still for a row while it goes on by far more
    than its noise and steps before and after it.

    Args:
        record: the record.
        angle: its channel that shows the motion.
    """
    n = len(record.time)
    alone, known = [], np.zeros(n)
    for channel, values in record.channels.items():
        good = record.trusted[channel]
        if channel in record.readable and np.ptp(values[good]) > 0.0:
            both = good & np.concatenate([[False], good[:-1]])
            alone.append((np.diff(values, prepend=np.nan) == 0.0) | ~both)
            known += both
    together = np.all(alone, axis=0) & (known > 0.5 * len(alone))
    for first, last in runs_of(together):
        together[first:last] &= last - first <= LONGEST
    if not together.any():
        return np.zeros(n, dtype=bool)
    values = record.filled(angle)
    way = np.abs(_usual(np.diff(values, prepend=values[0])))
    good = record.trusted[angle]
    moving = way > STEPS * max(noise_floor(values, good), quantisation_step(values[good]), 1e-300)
    by_accident = n * np.prod([(one & ~together).mean() for one in alone])
    # At rest, channels with coarse steps repeat together; a clock does not wait for that.
    evenly = (together & moving).sum() >= EVENLY * together.mean() * moving.sum()
    if by_accident <= BY_ACCIDENT and len(alone) > 1 and evenly:
        return np.asarray(together)
    return np.asarray(together & moving)


def _usual(steps: Array) -> Array:
    """Running median."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(steps, SPIKE_WINDOW, mode="nearest"))


def taut_string(x: Array, low: Array, high: Array) -> Array:
    """The shortest path that stays between two others, from the middle of both at its end, shape (n,).

    From each point it goes on straight as far as it can; where it must bend, it touches one of the two.

    Args:
        x: shape (n,), strictly increasing.
        low: shape (n,).
        high: shape (n,), above ``low``.
    """
    path, i = np.empty(len(x)), 0
    path[0] = 0.5 * (low[0] + high[0])
    while i < len(x) - 1:
        least, most, at_least, at_most = -np.inf, np.inf, i, i
        for j in range(i + 1, len(x)):
            width = x[j] - x[i]
            below, above = (low[j] - path[i]) / width, (high[j] - path[i]) / width
            if below > most or above < least:
                break
            if below > least:
                least, at_least = below, j
            if above < most:
                most, at_most = above, j
        else:
            j, width = len(x) - 1, x[-1] - x[i]
            below = above = (0.5 * (low[j] + high[j]) - path[i]) / width
        if above < least:
            slope, j = least, at_least
        elif below > most:
            slope, j = most, at_most
        else:
            slope = below
        path[i + 1 : j + 1] = path[i] + slope * (x[i + 1 : j + 1] - x[i])
        i = j
    return path
