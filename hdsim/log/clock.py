"""A recording's time: seconds out of what was written; samples spread over the ticks of a coarse clock."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.readers.contract import Numbers
from hdsim.log.units import TIME_UNITS

Array = NDArray[np.float64]

#: Range of what a constant rate leaves of stamps in whole ticks, in ticks: one, and the rate's own error.
WHOLE_TICK = 1.05
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

    Where one constant rate meets every stamp to a tick, it is that of the samples; else they are spread
    evenly over the sample number between changes of the clock.
    """
    steps = np.diff(time)
    if (steps < 0).any():
        k = int(np.flatnonzero(steps < 0)[0])
        raise InputError(f"{place}: time goes back: sample {k + 2} at {time[k + 1]:.9g} s")
    if not (steps > 0).any():
        raise InputError(f"{place}: the clock never advances")
    tick = float(np.median(steps[steps > 0]))
    missed = steps > 1.5 * tick
    stretches = np.split(time, np.flatnonzero(missed) + 1)
    period = (time[-1] - time[0] - steps[missed].sum()) / max(len(time) - len(stretches), 1)
    return np.concatenate([_evened(stretch, tick, period) for stretch in stretches])


def _evened(time: Array, tick: float, period: float) -> Array:
    """The times of one stretch; ``period`` is the mean one, for a stretch without a change of the clock."""
    index = np.arange(len(time), dtype=np.float64)
    first = np.flatnonzero(np.concatenate([[True], np.diff(time) > 0]))
    if len(first) < 2:
        return np.asarray(time[0] + period * index)
    rate, start = np.polyfit(index, time, 1)
    rest = time - (start + rate * index)
    if np.ptp(rest) <= WHOLE_TICK * tick:
        # A clock that counts whole ticks is late by half of one on the average.
        return np.asarray(start + rate * index + 0.5 * (rest.min() + rest.max() + tick))
    # After the last change the mean rate goes on.
    rate = (time[first[-1]] - time[0]) / first[-1]
    end = time[first[-1]] + rate * (len(time) - first[-1])
    return np.asarray(np.interp(index, np.append(first, len(time)), np.append(time[first], end)))
