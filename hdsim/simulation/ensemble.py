"""Many runs that differ in their numbers: each in one compiled call, side by side in threads, processes or
on a cluster.

The compiled call lets go of the interpreter, so that threads fill the cores. Which executor makes the runs,
and how many at a time, makes no difference to any number: a run has its own model, and its steps are those
of ``Run``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import _layout as layout
from hdsim.recording import Column, Event, Recording, Table
from hdsim.scenario import loaded
from hdsim.simulation.failures import speed_guard
from hdsim.simulation.run import Run, RunFailed, joined
from hdsim.simulation.setup import build_run
from hdsim.simulation.spans import stops

if TYPE_CHECKING:
    from pathlib import Path

    from hdsim.scenario import Scenario

Array = NDArray[np.float64]
T = TypeVar("T")
Given = TypeVar("Given")

#: Runs side by side in threads when nothing else is said.
THREADS = min(4, os.cpu_count() or 1)
_threads: ContextVar[int] = ContextVar("threads", default=THREADS)


@contextmanager
def in_threads(count: int) -> Iterator[None]:
    """While this lasts, so many runs are made side by side where nothing else is said."""
    before = _threads.set(count)
    try:
        yield
    finally:
        _threads.reset(before)


class InProcess(Executor):
    """Runs every task at once where it is submitted."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Call ``fn`` and return its finished future."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def as_completed(
    function: Callable[[Given], T], items: Iterable[Given], pool: Executor, width: int
) -> Iterator[tuple[int, T]]:
    """Apply a function to all items on an executor; yields index and result as they come, in any order.

    Args:
        function: what is done; for processes and clusters it can be pickled.
        items: taken from as there is room.
        pool: where it is done.
        width: how many are done at the same time; twice as many are handed out.

    Raises:
        Exception: what the function raised; the items that wait are then given up.
    """
    left = enumerate(items)
    window = width if isinstance(pool, InProcess) else 2 * width
    running: dict[Future[T], int] = {}
    try:
        while True:
            for index, item in left:
                running[pool.submit(function, item)] = index
                if len(running) >= window:
                    break
            if not running:
                return
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            # In the order of the items, where several ended at once.
            for future in sorted(done, key=running.__getitem__):
                index = running.pop(future)
                yield index, future.result()
    finally:
        for future in running:
            future.cancel()


def in_order(function: Callable[[Given], T], items: Sequence[Given], threads: int | None = None) -> list[T]:
    """Results of a function for all items, which are worked on side by side in threads.

    Args:
        function: what is done; what it computes must not depend on the thread.
        items: each is worked on once.
        threads: how many; when None as many as ``in_threads`` said, or as there are cores, up to four.
    """
    threads = min(_threads.get() if threads is None else threads, len(items))
    if threads < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        found = dict(as_completed(function, items, pool, threads))
    return [found[index] for index in range(len(items))]


def simulate_all(
    scenarios: Sequence[Scenario | str | Path],
    channels: Sequence[str],
    *,
    threads: int | None = None,
    pool: Executor | None = None,
) -> list[dict[str, Array]]:
    """Simulate many scenarios and keep some channels of each.

    What is kept is bounded by the channels asked for: a run's states are gone when they have been read.

    Args:
        scenarios: what to simulate, or their files.
        channels: names of channels of the state table.
        threads: runs at the same time; when None as many as there are cores, up to four.
        pool: an executor that makes them instead (processes, a Dask client's), ``threads`` at a time.

    Returns:
        For each scenario the channels, shape (samples,) each, bit for bit those of ``simulate``.

    Raises:
        InputError: there is no such channel.
        RunFailed: a run stopped early.
    """
    given = [loaded(scenario) for scenario in scenarios]
    if pool is None:
        return in_order(partial(_channels, channels=tuple(channels)), given, threads)
    # As plain data: classes of a scenario's sections are made as they are needed, and cannot be pickled.
    data = (scenario.model_dump(mode="json") for scenario in given)
    width = _threads.get() if threads is None else threads
    found = dict(as_completed(partial(_channels_of, channels=tuple(channels)), data, pool, width))
    return [found[index] for index in range(len(given))]


def _channels_of(data: dict[str, Any], channels: tuple[str, ...]) -> dict[str, Array]:
    """Channels of one run of a scenario that comes as plain data."""
    from hdsim.scenario import Scenario

    return _channels(Scenario.model_validate(data), channels)


def _channels(scenario: Scenario, channels: tuple[str, ...]) -> dict[str, Array]:
    """Channels of one run."""
    recording = record_at_once(build_run(scenario))
    return {name: recording[name] for name in channels}


def record_at_once(run: Run) -> Recording:
    """Make a run in one compiled call; what ``run.record()`` would keep is computed when it is read.

    Angles and velocities cost next to nothing, the first other channel costs them all, events the run once
    more. With another method than ``rodas4``, or a controller that runs at instants, it is ``run.record()``.

    Args:
        run: not yet begun.

    Returns:
        The recording, bit for bit that of ``run.record()``.

    Raises:
        RunFailed: the run stopped early; its ``recording`` holds what was computed.
    """
    if run.method == "rodas4" and run.loop is None and run.model.system.size:
        from hdsim.simulation.rosenbrock import rodas4_through

        model, spans = run.model, run.spans()
        found = rodas4_through(
            model.system,
            spans,
            run.y0,
            run.sample_times(),
            rtol=run.rtol,
            atol=run.rtol * model.system.scale if run.atol is None else run.atol,
            stops=stops(model, run.duration_s),
            inside_at=layout.INSIDE,
            guard=speed_guard(model),
            max_step=run.max_step_s,
        )
        if found.success:
            return _Computed(run, found.t, found.y.T, spans)
    # Also a run that stops early: what it says then is said in one place.
    recording = run.record()
    if run.interrupted is not None:
        raise run.interrupted
    if run.failure:
        error = RunFailed(run.failure)
        error.recording = recording
        raise error
    return recording


class _Computed(Recording):
    """The recording of a run that has been integrated, computed as far as it is read."""

    def __init__(self, run: Run, times: Array, states: Array, spans: Array) -> None:
        # A sample at a cut belongs to the span before.
        ends = np.searchsorted(times, spans[1:], side="right")
        inside = np.repeat(0.5 * (spans[:-1] + spans[1:]), np.diff(ends, prepend=0))
        self._run, self._samples, self._ends = run, (times, states, inside), ends
        self.tables = {"state": _Later(self, "state", run.observer.coordinates)}
        if run.teeth_every and run.model.teeth is not None:
            self.tables["teeth"] = _Later(self, "teeth")
        self.static = run.static()
        self.metadata, self.sensitivities = {}, {}

    @cached_property
    def coordinates(self) -> dict[str, Array]:
        """The channels that angles and velocities alone tell."""
        observer = self._run.observer
        return observer.values(observer.coordinates, *self._samples)

    @cached_property
    def computed(self) -> dict[str, Table]:
        """All tables, made block by block as the run itself would."""
        parts: dict[str, list[Table]] = {}
        first = 0
        for last in self._ends:
            if last - first >= self._run.block or last == self._ends[-1] > first:
                times, states, inside = (values[first:last] for values in self._samples)
                tables, _ = self._run.tables(times, states, inside, np.zeros(last - first))
                for name, table in tables.items():
                    parts.setdefault(name, []).append(table)
                first = last
        return {name: joined(tables) for name, tables in parts.items()}

    @cached_property
    def events(self) -> list[Event]:  # type: ignore[override]
        """What happened: only the run itself tells, with the work of each block of its samples."""
        return self._run.record().events


class _Later(Table):
    """A table whose columns are computed when they are read."""

    def __init__(self, of: _Computed, name: str, coordinates: tuple[str, ...] = ()) -> None:
        self._of, self._name = of, name
        self._coordinates = coordinates

    @cached_property
    def time(self) -> Array:  # type: ignore[override]
        """Time of the samples, s."""
        return self._of._samples[0] if self._name == "state" else self._of.computed[self._name].time

    @cached_property
    def columns(self) -> dict[str, Column]:  # type: ignore[override]
        """All columns."""
        return self._of.computed[self._name].columns

    def __getitem__(self, name: str) -> Array:
        """Values of a column."""
        if name not in self._coordinates or "columns" in self.__dict__:
            return super().__getitem__(name)
        return self._of.coordinates[name]

    def __contains__(self, name: object) -> bool:
        return name in self._coordinates or super().__contains__(name)
