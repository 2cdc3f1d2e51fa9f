"""A run that is watched while it is simulated, and a finished log served the same way."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.live.parameters import LiveParameters
from hdsim.live.player import FASTEST, SLOWEST, Player
from hdsim.live.server import DEFAULT_PORT, LiveServer
from hdsim.live.store import MessageStore, read_log
from hdsim.log import naming

if TYPE_CHECKING:
    from mcap import records

    from hdsim.scenario.model import Scenario
    from hdsim.simulation.run import Run

BLOCK_S = 1 / 30
"""Length of a block of samples, s of the wall clock."""


class LiveRun:
    """Shows a run while it is simulated; hand it to ``simulate_to_log`` as ``live``.

    The simulation keeps a tenth of a second ahead of what is seen, and waits while playback is paused or has
    gone back. The log gets every sample once, in order: it never sees a seek.

    Args:
        scenario: what is simulated.
        speed: simulated seconds in a second.
        host: address to listen at.
        port: 0 for any that is free.
    """

    def __init__(
        self, scenario: Scenario, *, speed: float = 1.0, host: str = "127.0.0.1", port: int = DEFAULT_PORT
    ) -> None:
        self.speed = min(max(speed, SLOWEST), FASTEST)
        self._store = MessageStore()
        self._duration = scenario.run.duration_s
        end = naming.EPOCH_NS + round(1e9 * self._duration)
        self.player = Player(
            self._store, naming.EPOCH_NS, end, speed=self.speed, computed=naming.EPOCH_NS - 1
        )
        self.parameters = LiveParameters(scenario)
        self.server = LiveServer(
            self.player,
            self._store,
            name=scenario.name or "hdsim",
            host=host,
            port=port,
            parameters=self.parameters,
        )
        self.address = self.server.address
        self._run: Run | None = None

    def attach(self, run: Run) -> None:
        """Take over a run's pace."""
        self._run = run
        run.block = min(run.block, max(1, round(run.sample_rate_hz * self.speed * BLOCK_S)))
        run.before_span = self._before_span
        self.player.start()

    def watch(
        self,
        schema: records.Schema,
        channel: records.Channel,
        log_times: Sequence[int],
        bodies: Sequence[bytes],
    ) -> None:
        """Take the log's messages as they are written."""
        self._store.add(schema, channel, log_times, bodies)

    def computed(self, time: float) -> None:
        """The log is complete up to a run time, s."""
        if time >= self._duration:
            self.parameters.end(time)
        self.player.advance(naming.EPOCH_NS + math.floor(1e9 * time))

    def _before_span(self, start: float) -> Callable[[], object] | None:
        assert self._run is not None
        self.player.wait_until_wanted(naming.EPOCH_NS + round(1e9 * start))
        return self.parameters.take(self._run, start)

    def finish(self) -> None:
        """Play to the end, then serve as long as somebody watches."""
        self.player.wait_for_end()
        while self.server.viewers:
            _sleep()

    def close(self) -> None:
        """Stop serving."""
        self.player.stop()
        self.server.stop()
        self._store.close()


class LiveReplay:
    """Serves a finished log; playback begins when the first viewer has come.

    Args:
        path: the log.
        speed: seconds of the log in a second.
        host: address to listen at.
        port: 0 for any that is free.

    Raises:
        InputError: the log cannot be read, or the address cannot be used.
    """

    def __init__(
        self, path: str | Path, *, speed: float = 1.0, host: str = "127.0.0.1", port: int = DEFAULT_PORT
    ) -> None:
        self._store = MessageStore()
        start, end = read_log(path, self._store)
        self.player = Player(self._store, start, end, speed=speed, computed=end)
        self.server = LiveServer(
            self.player, self._store, name=Path(path).stem, host=host, port=port, wait=True
        )
        self.address = self.server.address
        self.server.advertise()
        self.player.start()

    def close(self) -> None:
        """Stop serving."""
        self.player.stop()
        self.server.stop()
        self._store.close()


def _sleep() -> None:
    import time

    time.sleep(0.1)
