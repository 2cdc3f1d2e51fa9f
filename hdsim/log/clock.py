"""A recording's time: seconds out of what was written; samples spread over the ticks of a coarse clock."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.readers.contract import Numbers
from hdsim.log.units import TIME_UNITS

Array = NDArray[np.float64]

#: Range of what a constant rate leaves of stamps in whole ticks, in ticks: one, and the rate's own error.
WHOLE_TICK = 1.05
#: Longest tick in which a sample that is missing shows at all, in periods of the samples.
QUICK = 2.0
#: Ticks from one stamp to the next beyond which a recording paused: it goes on where it goes on.
PAUSE = 10.0
#: Most samples between pauses that are looked for as missing.
MOST_MISSING = 40
#: Samples that tell whether there is a rate at all.
ENOUGH = 8000
#: Rounds in which their rate is found, each with the places of those that were missing at the last one.
REFINED = 3
_SECOND_DAY = np.datetime64("1970-01-02", "ns")


def seconds(recorded: Numbers, unit: str, wraps_at: float | None, place: str) -> Array:
    """A recorded time in s; dates count from the first one, which keeps them exact to 1 ns."""
    dates = recorded.dtype.kind == "M"
    if dates != (unit == "iso"):
        raise InputError(
            f"{place}: the time's unit is {unit}, but its column holds {'dates: iso' if dates else 'numbers'}"
        )
    if not dates:
        whole = recorded if wraps_at is None else np.unwrap(recorded, period=wraps_at)
        return np.asarray(whole * TIME_UNITS[unit], np.float64)
    counted = (recorded - recorded[0]) / np.timedelta64(1, "s")
    # A time of day that passes midnight goes on.
    return np.asarray(np.unwrap(counted, period=86400.0) if recorded[0] < _SECOND_DAY else counted)


def spread(time: Array, place: str) -> Array:
    """Times for samples that share one, stretch by stretch between missed ticks of the clock.

    Where one constant rate meets every stamp to a tick, it is that of the samples, but for those that are
    missing; else they are spread evenly over the sample number between changes of the clock.
    """
    steps = np.diff(time)
    if (steps < 0).any():
        k = int(np.flatnonzero(steps < 0)[0])
        raise InputError(f"{place}: time goes back: sample {k + 2} at {time[k + 1]:.9g} s")
    if not (steps > 0).any():
        raise InputError(f"{place}: the clock never advances")
    tick = float(np.median(steps[steps > 0]))
    if (steps == 0).any():
        parts = [_one_rate(part, tick) for part in np.split(time, np.flatnonzero(steps > PAUSE * tick) + 1)]
        even = [part for part in parts if part is not None]
        if len(even) == len(parts):
            return np.concatenate(even)
    missed = steps > 1.5 * tick
    stretches = np.split(time, np.flatnonzero(missed) + 1)
    period = (time[-1] - time[0] - steps[missed].sum()) / max(len(time) - len(stretches), 1)
    return np.concatenate([_evened(stretch, tick, period) for stretch in stretches])


def _one_rate(time: Array, tick: float) -> Array | None:
    """The times of samples at one constant rate of which a few are missing; None where there is none.

    A clock that is about as quick as the samples shows two at one tick and none at the next, which is no
    sample that is missing: that one leaves all later ones late. The fewest count.
    """
    if len(time) < 3 or time[-1] == time[0]:
        return None
    number = np.arange(len(time), dtype=np.float64)
    found = _at_one_rate(time, number, tick)
    span = time[-1] - time[0]
    if found is not None or tick > QUICK * span / (len(time) - 1):
        return found
    if len(time) > 2 * ENOUGH and _one_rate(time[:ENOUGH], tick) is None:
        return None  # a clock that is not steady shows it soon
    for missing in range(MOST_MISSING + 1):
        # The stamps at both ends are each a tick late at most.
        for ends in (0.0, -0.5, 0.5):
            rate = (span + ends * tick) / (len(time) - 1 + missing)
            for _ in range(REFINED):
                number = _counted(time, tick, rate)
                if number[-1] - len(time) > 2 * MOST_MISSING:
                    break
                rate = _rate(time, number, tick)
                found = _at_one_rate(time, number, tick, rate)
                if found is not None:
                    return found
    return None


def _rate(time: Array, number: Array, tick: float) -> float:
    """The rate that leaves the least range of the stamps: which of two ticks they take is not by chance."""
    from scipy.optimize import minimize_scalar

    rate = float(np.polyfit(number, time, 1)[0])
    reach = 2.0 * tick / (number[-1] - number[0])
    found = minimize_scalar(
        lambda own: float(np.ptp(time - own * number)),
        bounds=(rate - reach, rate + reach), method="bounded", options={"xatol": 1e-3 * reach},
    )  # fmt: skip
    return float(found.x)


def _at_one_rate(time: Array, number: Array, tick: float, rate: float | None = None) -> Array | None:
    """Times of numbered samples at their mean rate; None where it misses stamps by more than a tick."""
    rate = float(np.polyfit(number, time, 1)[0]) if rate is None else rate
    rest = time - rate * number
    if np.ptp(rest) > WHOLE_TICK * tick:
        return None
    # A clock that counts whole ticks is late by half of one on the average.
    return np.asarray(rate * number + 0.5 * (rest.min() + rest.max() + tick))


def _counted(time: Array, tick: float, rate: float) -> Array:
    """Numbers of samples at a rate: one is missing where a stamp is later than any before by over a tick."""
    phase = time - rate * np.arange(len(time))
    number, missing, least = np.empty(len(time)), 0, math.inf
    for k, own in enumerate(phase.tolist()):
        least = min(least, own - rate * missing)
        while own - rate * missing > least + WHOLE_TICK * tick:
            missing += 1
        number[k] = k + missing
    return number


def _evened(time: Array, tick: float, period: float) -> Array:
    """The times of one stretch; ``period`` is the mean one, for a stretch without a change of the clock."""
    index = np.arange(len(time), dtype=np.float64)
    first = np.flatnonzero(np.concatenate([[True], np.diff(time) > 0]))
    if len(first) < 2:
        return np.asarray(time[0] + period * index)
    even = _at_one_rate(time, index, tick)
    if even is not None:
        return even
    # After the last change the mean rate goes on.
    rate = (time[first[-1]] - time[0]) / first[-1]
    end = time[first[-1]] + rate * (len(time) - first[-1])
    return np.asarray(np.interp(index, np.append(first, len(time)), np.append(time[first], end)))
