"""The clock of what viewers see: it runs at a multiple of real time, pauses, and goes back on request."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from hdsim.live.store import MessageStore

TICK_S = 1 / 60
"""Time between two deliveries, s of the wall clock."""

LEAD_S = 0.1
"""How far the simulation may be ahead of what is seen, s of the wall clock."""

PATIENCE_S = 0.5
"""How long playback waits for the simulation before it says so, s of the wall clock: blocks come unevenly."""

SLOWEST, FASTEST = 1e-4, 1e4

_ONLY_LATEST = ("/hd/scene", "/hd/transforms")
"""Topics of which one message a delivery is enough, because the next one replaces it."""


class Viewer(Protocol):
    """Where the player delivers."""

    def wants(self, topic: str) -> bool:
        """Whether anybody would get messages of a topic."""

    def publish(self, topic: str, log_time: int, body: bytes) -> None:
        """Send one message; must not wait for anybody."""

    def tell(self, state: Playback) -> None:
        """Say where playback is; called after each delivery."""


@dataclass(frozen=True)
class Playback:
    """Where playback is.

    Args:
        time: ns since 1970.
        speed: simulated seconds in a second.
        paused: whether it stands still.
        waiting: whether it has been waiting for what is not computed yet.
        ended: whether it is at the end.
        jumped: whether it has just been moved by a seek.
    """

    time: int
    speed: float
    paused: bool
    waiting: bool
    ended: bool
    jumped: bool = False


class Player(threading.Thread):
    """Delivers messages of a store as its own clock passes them.

    Args:
        store: the messages.
        start: first time, ns.
        end: last time, ns.
        speed: simulated seconds in a second.
        computed: time up to which the store is complete, ns.
    """

    def __init__(self, store: MessageStore, start: int, end: int, *, speed: float, computed: int) -> None:
        super().__init__(name="hdsim-live", daemon=True)
        self._store = store
        self._change = threading.Condition()
        self.start_time, self.end_time = start, end
        self._position = start - 1
        self._highest = start - 1
        self._computed = computed
        self._speed = speed
        self._paused = self._stopped = False
        self._jumped = True
        self._moved_at = time.monotonic()
        self._stale: set[str] = set()
        self._seen: dict[str, int] = {}
        self.viewer: Viewer | None = None

    # What viewers ask for.

    def pause(self, paused: bool = True) -> None:
        """Stop or go on."""
        with self._change:
            self._paused = paused
            self._change.notify_all()

    def set_speed(self, speed: float) -> None:
        """Set the speed; it is kept between 1e-4 and 1e4."""
        with self._change:
            self._speed = min(max(speed, SLOWEST), FASTEST)
            self._change.notify_all()

    def seek(self, at: int) -> None:
        """Go to a time (ns) among what has been shown or computed."""
        with self._change:
            self._position = min(max(at, self.start_time), self._computed)
            self._jumped = True
            self._change.notify_all()

    def refresh(self, topic: str) -> None:
        """Deliver the latest message of a topic again, for a viewer that has just come."""
        with self._change:
            self._stale.add(topic)

    @property
    def state(self) -> Playback:
        """Where playback is."""
        with self._change:
            return self._state(jumped=False)

    # What the simulation asks for.

    def advance(self, computed: int) -> None:
        """Say up to which time (ns) the store is complete."""
        with self._change:
            self._computed = max(self._computed, computed)
            self._change.notify_all()

    def wait_until_wanted(self, at: int) -> None:
        """Wait until the simulation may go beyond ``at`` (ns): playback is near it, and not paused."""
        with self._change:
            while not self._stopped:
                ahead = at - max(self._position, self.start_time)
                lead = LEAD_S * self._speed * 1e9
                if not self._paused and ahead <= lead:
                    return
                self._change.wait(TICK_S)

    def wait_for_end(self) -> None:
        """Wait until all has been shown."""
        with self._change:
            while not (self._stopped or self._state(False).ended):
                self._change.wait(0.05)

    def stop(self) -> None:
        """End the thread."""
        with self._change:
            self._stopped = True
            self._change.notify_all()
        if self.is_alive():
            self.join(5)

    def run(self) -> None:
        """Deliver until stopped."""
        last = time.monotonic()
        while True:
            with self._change:
                if self._stopped:
                    return
                self._change.wait(TICK_S)
                now = time.monotonic()
                since, jumped = self._position, self._jumped
                self._jumped = False
                stale, self._stale = self._stale, set()
                if not self._paused and not jumped:
                    step = round((now - last) * self._speed * 1e9)
                    self._position = max(since, min(since + step, self._computed))
                if self._position != since or self._paused or jumped:
                    self._moved_at = now
                upto = self._position
                state = self._state(jumped)
                self._change.notify_all()
            last = now
            if self.viewer is None:
                continue
            if jumped:
                # Viewers throw away what they have when time goes back, and the SDK may let messages overtake
                # the time. So what there is to show comes with the next delivery.
                self._store.rewind(self._seen, upto)
                with self._change:
                    self._stale |= set(self._store.topics)
                self.viewer.tell(state)
                continue
            again = [m for m in self._store.latest(since) if m[1] in stale] if stale else []
            for at, topic, body in [*again, *self._messages(upto, self.viewer.wants)]:
                self.viewer.publish(topic, at, body)
            self.viewer.tell(state)

    def _messages(self, upto: int, wanted: Callable[[str], bool]) -> list[tuple[int, str, bytes]]:
        found = self._store.following(self._seen, upto, wanted)
        last = {topic: k for k, (_, topic, _) in enumerate(found) if topic in _ONLY_LATEST}
        return [m for k, m in enumerate(found) if last.get(m[1], k) == k]

    def _state(self, jumped: bool) -> Playback:
        ended = self._position >= self.end_time
        still = time.monotonic() - self._moved_at > PATIENCE_S
        waiting = still and self._position >= self._computed and not ended
        position = max(self._position, self.start_time)
        return Playback(position, self._speed, self._paused, waiting, ended, jumped)
