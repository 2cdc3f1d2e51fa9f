"""Conditions on a channel that are told in words when they begin and end, however the samples are cut."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.recording import Event

Array = NDArray[np.float64]

#: How the message of a crossing begins, either way.
CROSSED = "gap crossed"


@dataclass
class Watch:
    """A condition on one channel, with a margin between its beginning and its end.

    Args:
        source: who tells.
        level: of the event at its beginning.
        begins: what is told when ``value`` rises above ``on``; ``{value}`` is the number.
        ends: what is told when it falls below ``off`` again; nothing when empty.
        on: threshold of the beginning.
        off: threshold of the end, at most ``on``.
    """

    source: str
    level: str
    begins: str
    ends: str
    on: float
    off: float
    _holds: bool = False
    _last: tuple[float, float] | None = None

    def feed(self, time: Array, value: Array) -> Iterator[Event]:
        """Events in the next samples: time (n,) in s, value (n,)."""
        if self._last is None:
            self._last = (float(time[0]), -np.inf)
        times = np.concatenate([[self._last[0]], time])
        values = np.concatenate([[self._last[1]], value])
        at = 1
        while at < len(values):
            threshold = self.off if self._holds else self.on
            over = values[at:] >= threshold
            changed = np.flatnonzero(over != self._holds)
            if not len(changed):
                break
            at += int(changed[0])
            self._holds = not self._holds
            text = self.begins if self._holds else self.ends
            if text:
                moment = _crossing(times[at - 1 : at + 1], values[at - 1 : at + 1], threshold)
                level = self.level if self._holds else "info"
                yield Event(moment, level, self.source, text.format(value=values[at]))
            at += 1
        self._last = (float(times[-1]), float(values[-1]))


@dataclass
class Flanks:
    """Torque that changes its sign: the teeth go from one flank through the gap to the other.

    Args:
        unloaded: torque below which no flank is loaded, N m.
    """

    unloaded: float
    _side: float = 0.0
    _left: float = 0.0

    def feed(self, time: Array, torque: Array) -> Iterator[Event]:
        """Events in the next samples: time (n,) in s, torque (n,) in N m."""
        side = np.where(torque > self.unloaded, 1.0, np.where(torque < -self.unloaded, -1.0, 0.0))
        loaded = np.flatnonzero(side)
        for k in loaded[np.diff(side[loaded], prepend=self._side) != 0]:
            if self._side:
                before = loaded[loaded < k]
                left = float(time[before[-1]]) if len(before) else self._left
                way = (
                    "from the positive to the negative"
                    if side[k] < 0
                    else "from the negative to the positive"
                )
                took = 1e3 * (float(time[k]) - left)
                yield Event(left, "info", "mesh", f"{CROSSED} {way} flank in {took:.3g} ms")
            self._side = float(side[k])
        if len(loaded):
            self._left = float(time[loaded[-1]])


def _crossing(times: Array, values: Array, threshold: float) -> float:
    """When a straight line between two samples meets the threshold; the later one where it has no slope."""
    low, high = values
    if not np.isfinite(low) or low == high:
        return float(times[1])
    share = min(max((threshold - low) / (high - low), 0.0), 1.0)
    return float(times[0] + share * (times[1] - times[0]))
