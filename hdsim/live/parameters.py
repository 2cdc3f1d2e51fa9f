"""Numbers of a scenario that may be changed while it runs."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import HdsimError, InputError
from hdsim.recording import Event

if TYPE_CHECKING:
    from hdsim.scenario.model import Scenario
    from hdsim.simulation.run import Run


class LiveParameters:
    """The marked numbers, and the changes that wait to be taken over.

    A viewer's thread asks (`request`), the simulation's takes over (`take`). A change takes effect between
    two spans: the scenario with the new number is assembled as a model and its numbers replace those of the
    running one, which keeps its state. Signals and controllers must keep their structure: a change that
    needs another one is refused.

    Args:
        scenario: the scenario; ``live.parameters`` names what may be changed.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._lock = threading.Lock()
        self._waiting: dict[str, float] = {}
        self._refused: list[str] = []
        self._ended: float | None = None
        self.values = {name: value_of(scenario, name) for name in scenario.live.parameters}

    def request(self, name: str, value: float) -> None:
        """Ask for a change.

        Raises:
            InputError: the scenario doesn't mark the number, or doesn't allow the value, or the run is over.
        """
        if name not in self.values:
            marked = ", ".join(self.values) or "none"
            raise InputError(f"{name} may not be changed while it runs; the scenario marks: {marked}")
        with self._lock:
            if self._ended is not None:
                raise InputError(self._too_late(name, value))
            with_all = {**self.values, **self._waiting, name: value}
            self._scenario.with_(with_all)
            self._waiting[name] = value

    def take(self, run: Run, now: float) -> Callable[[], None] | None:
        """What has to be done for the changes that wait; None when there are none."""
        with self._lock:
            waiting, self._waiting = self._waiting, {}
        waiting = {name: value for name, value in waiting.items() if value != self.values[name]}
        if not waiting:
            return None
        return lambda: self._apply(run, waiting, now)

    def end(self, reached: float) -> None:
        """Say that the run is over: changes that still wait are refused, as are all that come later.

        Args:
            reached: simulated time that was reached, s.
        """
        with self._lock:
            self._ended = reached
            self._refused += [self._too_late(name, value) for name, value in self._waiting.items()]
            self._waiting = {}

    def refusals(self) -> list[str]:
        """What has been refused since the last call, to be told to viewers."""
        with self._lock:
            found, self._refused = self._refused, []
        return found

    def _too_late(self, name: str, value: float) -> str:
        return (
            f"{name}: {value:g} comes too late, the run is simulated to its end at {self._ended:g} s; "
            f"it stays {self.values[name]:g}"
        )

    def _apply(self, run: Run, waiting: dict[str, float], now: float) -> None:
        try:
            scenario = self._scenario.with_({**self.values, **waiting})
            exchange(run, scenario)
        except HdsimError as error:
            reason = str(error).splitlines()[0]
            run.events.append(Event(now, "warning", "live", f"change refused: {reason}"))
            with self._lock:
                self._refused.append(reason)
            return
        for name, value in waiting.items():
            run.events.append(Event(now, "info", "live", f"{name}: {self.values[name]:g} -> {value:g}"))
            self.values[name] = value


def value_of(scenario: Scenario, name: str) -> float:
    """The number under a dotted name.

    Raises:
        InputError: there is none.
    """
    found: Any = scenario
    for part in name.split("."):
        found = getattr(found, part, None)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise InputError(f"live.parameters: {name} is no number of this scenario")
    return float(found)


def exchange(run: Run, scenario: Scenario) -> None:
    """Give a running model the numbers of another scenario.

    Raises:
        InputError: the scenario's model is built differently.
    """
    from hdsim.drive import _layout as a
    from hdsim.simulation.setup import build_run

    fresh = build_run(scenario)
    old, new = run.model.system, fresh.model.system
    same = np.array_equal(old.integers, new.integers) and old.reals.shape == new.reals.shape
    pairs = zip(run.model.signals, fresh.model.signals, strict=False)
    same = same and all(
        np.array_equal(x.corners(0.0, run.duration_s), y.corners(0.0, run.duration_s)) for x, y in pairs
    )
    if not same:
        raise InputError("the change would build the model differently, or move corners of a signal")
    kept = {a.INSIDE: old.reals[a.INSIDE]}
    if run.loop is not None:
        kept[run.loop.place] = old.reals[run.loop.place]
    old.reals[:] = new.reals
    for place, value in kept.items():
        old.reals[place] = value
    if run.loop is not None and fresh.loop is not None:
        fresh.loop.controller.state = run.loop.controller.state
        run.loop.controller = fresh.loop.controller
