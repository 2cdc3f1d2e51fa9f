"""Limit cycles at rest: a loop that goes on swinging where its command stands still.

Play, stiction or a quantised encoder inside a loop with integral action keep a swing of constant size alive
(Nordin and Gutman 2002, Automatica 38:1633; Olsson and Aastroem 2001, Eur. J. Control 7:188). Its mean may
well be on target: a mean error does not show it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hdsim.recording import Event

Array = NDArray[np.float64]

ARCSEC = 180.0 * 3600.0 / math.pi
#: Least amplitude that counts, rad: 1 arcsec, below what an output encoder of 20 bits resolves.
LEAST = 1.0 / ARCSEC
#: Periods that have to be seen: fewer may be ringing that dies.
PERIODS = 3
#: Least swing of the last third of the periods over that of the first: ringing dies faster, from 1 % of the
#: critical damping on. Of periods, each from its own lowest to its highest, so that no drift adds to it.
KEPT = 0.9
#: Largest standard deviation of the periods, as a share of their mean.
REGULAR = 0.25
#: Longest stretch of a rest that is looked at, s.
LONGEST_S = 10.0


@dataclass(frozen=True)
class LimitCycle:
    """A swing that does not die.

    Args:
        amplitude_rad: half of peak to peak.
        frequency_hz: of its periods' mean.
        low_rad: lowest error.
        high_rad: highest error.
    """

    amplitude_rad: float
    frequency_hz: float
    low_rad: float
    high_rad: float


def limit_cycle(time: Array, error: Array) -> LimitCycle | None:
    """The limit cycle in the later half of a rest, if there is one.

    Args:
        time: of the rest, s, shape (n,).
        error: output less commanded angle, rad, shape (n,).

    Returns:
        What swings there for three periods at least, evenly, without getting smaller; None if nothing does.
    """
    late = time >= max(0.5 * (time[0] + time[-1]), time[-1] - LONGEST_S)
    t, x = time[late], error[late]
    if len(t) < 4 * PERIODS:
        return None
    low, high = float(np.min(x)), float(np.max(x))
    amplitude = 0.5 * (high - low)
    if amplitude < LEAST:
        return None
    y = x - 0.5 * (high + low)
    # A period goes from one rise to the next, with a fall between them: ripples near the middle are none.
    side = np.where(y > 0.3 * amplitude, 1, np.where(y < -0.3 * amplitude, -1, 0))
    told = np.flatnonzero(side)
    rises = told[1:][np.diff(side[told]) > 0]
    if len(rises) < PERIODS + 1:
        return None
    periods = np.diff(t[rises])
    swings = [float(np.ptp(part)) for part in np.split(x, rises)[1:-1]]
    third = len(swings) // PERIODS
    if np.std(periods) > REGULAR * np.mean(periods) or sum(swings[-third:]) < KEPT * sum(swings[:third]):
        return None
    return LimitCycle(amplitude, 1.0 / float(np.mean(periods)), low, high)


@dataclass
class RestWatch:
    """Tells of a limit cycle when a rest of the command ends, however the samples are cut into blocks."""

    _times: list[Array] = field(default_factory=list)
    _errors: list[Array] = field(default_factory=list)
    _since: float = 0.0

    def feed(self, time: Array, error: Array, rests: NDArray[np.bool_]) -> Iterator[Event]:
        """Events of the rests that end in the next samples.

        Args:
            time: s, shape (n,).
            error: output less commanded angle, rad, shape (n,).
            rests: whether the command has not moved since the sample before, shape (n,).
        """
        ends = np.flatnonzero(np.diff(rests.astype(np.int8))) + 1
        for part in np.split(np.arange(len(time)), ends):
            if not rests[part[0]]:
                yield from self.end()
                continue
            if not self._times:
                self._since = float(time[part[0]])
            self._times.append(time[part])
            self._errors.append(error[part])
            # The later half of what is left, at most so much of it, is all that will be looked at.
            while len(self._times) > 1 and time[part[-1]] - self._times[1][0] > 2.0 * LONGEST_S:
                del self._times[0], self._errors[0]

    def end(self) -> Iterator[Event]:
        """The event of the rest that ends here, if it swung."""
        if self._times:
            time = np.concatenate(self._times)
            found = limit_cycle(time, np.concatenate(self._errors))
            self._times, self._errors = [], []
            if found is not None:
                text = (
                    f"limit cycle at rest: the output swings by {ARCSEC * found.amplitude_rad:.3g} arcsec "
                    f"({ARCSEC * found.low_rad:.3g} to {ARCSEC * found.high_rad:.3g} off its command) at "
                    f"{found.frequency_hz:.3g} Hz; the command rests since {self._since:.4g} s"
                )
                yield Event(float(time[-1]), "warning", "command", text)
