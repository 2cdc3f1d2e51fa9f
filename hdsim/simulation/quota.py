"""Which events of one kind are told singly, so that a kind that repeats is told to the end of the run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from hdsim.recording import Event

#: Events of one kind that are told singly in a run.
MOST = 12
#: Of these, the events that may come at once.
BURST = 4


@dataclass
class Quota:
    """Tells events of one kind: the first few at once, then what the rest of the quota allows, spread evenly.

    A kind begins with `BURST` events in store and gets another one each time a ``MOST - BURST``-th of the
    run has passed, up to `BURST` again: never more than `MOST` in a run, and one whenever it has been quiet.
    Those in between are counted. Their number is told before the next one, or as soon as it has been quiet
    that long.

    Args:
        kind: what happens, in words.
        duration: length of the run, s.
        ends: message of the end of what a message begins; it is told if its beginning was.
    """

    kind: str
    duration: float
    ends: str = ""
    _store: float = BURST
    _filled: float = 0.0
    _told: bool = True
    _source: str = ""
    _count: int = 0
    _last: float = 0.0
    _level: str = "info"

    @property
    def _interval(self) -> float:
        return self.duration / (MOST - BURST)

    def feed(self, events: Iterable[Event], upto: float) -> list[Event]:
        """What is told of the next events.

        Args:
            events: in the order of time.
            upto: time up to which there are no others, s.
        """
        told: list[Event] = []
        for event in events:
            told += self._quiet(event.time)
            end = bool(self.ends) and event.message == self.ends
            if not end:
                self._store = min(BURST, self._store + (event.time - self._filled) / self._interval)
                self._filled = event.time
                self._told = self._store >= 1
                self._store -= self._told
            if self._told:
                told += [*self._summary(event.time), event]
            else:
                self._count += not end
                self._level = self._level if end else event.level
                self._last, self._source = event.time, event.source
        return told + self._quiet(upto)

    def finish(self, time: float) -> list[Event]:
        """What has not been told at the end of the run."""
        return self._summary(time)

    def _quiet(self, now: float) -> list[Event]:
        at = self._last + self._interval
        return self._summary(at) if now > at else []

    def _summary(self, time: float) -> list[Event]:
        if not self._count:
            return []
        times = "time" if self._count == 1 else "times"
        text = f"{self._count} more {times} until {self._last:.6g} s: {self.kind}"
        self._count = 0
        return [Event(time, self._level, self._source, text)]
