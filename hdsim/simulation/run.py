"""The driver: spans between discontinuities, samples in blocks, the energy audit.

Every span between two corners (of trajectories, loads, controller samples) is one call of
``scipy.integrate.solve_ivp``. Samples leave in blocks as they are computed, so that a log written on the
way loses nothing when a run is stopped.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import HdsimError
from hdsim.recording import Column, Event, Recording, Table
from hdsim.simulation.audit import Audit
from hdsim.simulation.channels import Observer
from hdsim.simulation.events import EventDetector
from hdsim.simulation.failures import speed_guard, told
from hdsim.simulation.solvers import Statistics, integrate
from hdsim.simulation.spans import cuts, stops

if TYPE_CHECKING:
    from hdsim.actuation.signal_data import SignalData
    from hdsim.drive.model import Model

Array = NDArray[np.float64]

#: Samples of the state table that leave together, and the longest span in samples.
BLOCK = 4000


@dataclass
class SampledLoop:
    """A controller that runs at instants and holds its torque in between.

    Args:
        controller: ``update(t, readings) -> torque`` (``hdsim.actuation``).
        period_s: time between two instants.
        place: index of the held torque in the system's reals.
    """

    controller: Any
    period_s: float
    place: int


class RunFailed(HdsimError):  # noqa: N818 - read aloud: "run failed"
    """The integration stopped before the end; ``recording`` holds everything up to there."""

    recording: Recording | None = None


class Run:
    """One simulation of a model, sample block by sample block.

    Args:
        model: the drive with its parts.
        duration_s: length of the run.
        sample_rate_hz: rate of the state table.
        teeth_rate_hz: rate of the teeth table (0: none); at most the sample rate.
        y0: initial state; the model's own when None.
        method: name in ``hdsim.simulation.solvers.METHODS``.
        rtol: relative tolerance.
        atol: absolute tolerance of every state in its unit; rtol times each state's scale when None.
        max_step_s: largest step.
        reference: the commanded angle of the output, rad.
        loop: the sampled controller.

    Attributes:
        audit: the energy balance so far.
        statistics: the solver's work so far.
        events: what happened so far.
        failure: why the run stopped early, or None.
        reached_s: how far it came, where it stopped early.
    """

    def __init__(
        self,
        model: Model,
        *,
        duration_s: float,
        sample_rate_hz: float,
        teeth_rate_hz: float = 0.0,
        y0: Array | None = None,
        method: str = "rodas4",
        rtol: float = 1e-6,
        atol: float | None = None,
        max_step_s: float = math.inf,
        reference: SignalData | None = None,
        loop: SampledLoop | None = None,
    ) -> None:
        self.model = model
        self.duration_s = duration_s
        self.sample_rate_hz = sample_rate_hz
        self.teeth_every = max(1, round(sample_rate_hz / teeth_rate_hz)) if teeth_rate_hz > 0 else 0
        self.method, self.rtol, self.atol, self.max_step_s = method, rtol, atol, max_step_s
        self.y0 = model.system.y0.copy() if y0 is None else y0
        self.loop = loop
        self.observer = Observer(model, reference)
        self.audit = Audit()
        self.statistics = Statistics()
        self.events: list[Event] = []
        #: Called before every span with its start (s); what it returns, if anything, is called once the
        #: samples so far have been handed out: it may change the system's reals (live parameters).
        self.before_span: Callable[[float], Callable[[], object] | None] | None = None
        #: Samples of the state table that leave together, and the longest span in samples.
        self.block = BLOCK
        self.failure: str | None = None
        self.reached_s: float | None = None
        self.interrupted: BaseException | None = None
        # True channels as far back as the sensors look: for the controller, and for the log.
        self._recent: Table | None = None
        self._history: Table | None = None

    @cached_property
    def detector(self) -> EventDetector:
        """What notices events; a run of an ensemble has none."""
        return EventDetector(self.model, self.duration_s)

    def spans(self) -> Array:
        """Times at which the integration is cut, from 0 to the duration: shape (spans + 1,)."""
        longest = self.block / self.sample_rate_hz
        further = longest * np.arange(1.0, math.ceil(self.duration_s / longest))
        if self.loop is not None:
            period = self.loop.period_s
            instants = period * np.arange(float(math.ceil(self.duration_s / period - 1e-9)))
            further = np.concatenate([further, instants])
        return cuts(self.model.signals, self.duration_s, further)

    def sample_times(self) -> Array:
        """Times of the state table, s, shape (m,)."""
        count = math.floor(self.duration_s * self.sample_rate_hz * (1 + 1e-12)) + 1
        return np.arange(count) / self.sample_rate_hz

    def blocks(self, on_time: Callable[[float], object] | None = None) -> Iterator[dict[str, Table]]:
        """Integrate; yields tables by name as soon as a block of samples is complete.

        Args:
            on_time: called now and then with the time that has been reached, s.
        """
        from hdsim.drive import _layout as a

        guard = speed_guard(self.model)

        def watch(t: float, y: Array) -> None:
            if guard is not None and abs(y[guard.index]) > guard.limit:
                raise guard.error()
            if on_time is not None:
                on_time(t)

        samples = self.sample_times()
        spans, corners = self.spans(), stops(self.model, self.duration_s)
        reals = self.model.system.reals
        y = self.y0
        step: float | None = None
        times: list[Array] = []
        states: list[Array] = []
        insides: list[Array] = []
        helds: list[Array] = []
        waiting = 0
        done = 0
        self.events += self.detector.start(self.method)
        for t0, t1 in itertools.pairwise(spans):
            change = None if self.before_span is None else self.before_span(float(t0))
            if change is not None:
                if waiting:
                    yield self._block(*(np.concatenate(part) for part in (times, states, insides, helds)))
                    times, states, insides, helds, waiting = [], [], [], [], 0
                change()
            inside = 0.5 * (t0 + t1)
            reals[a.INSIDE] = inside
            if self.loop is not None:
                self._control(t0, y, inside)
            last = int(np.searchsorted(samples, t1, side="right"))
            wanted = samples[done:last]
            found = integrate(
                self.model.system,
                float(t0),
                float(t1),
                y,
                method=self.method,
                rtol=self.rtol,
                atol=self.atol,
                t_eval=np.clip(wanted, t0, t1),
                first_step=step,
                max_step=self.max_step_s,
                stops=corners[np.searchsorted(corners, t0) : np.searchsorted(corners, t1)],
                on_step=watch,
            )
            self.statistics.add(found.statistics)
            got = found.y.shape[1]
            if got:
                times.append(wanted[:got])
                states.append(found.y.T)
                insides.append(np.full(got, inside))
                helds.append(np.full(got, 0.0 if self.loop is None else reals[self.loop.place]))
                waiting += got
            y, step, done = found.y_end, found.next_step, last
            if on_time is not None:
                on_time(found.t_end)
            if not found.success:
                self._fail(found)
            if waiting >= self.block or (waiting and (self.failure or t1 == spans[-1])):
                yield self._block(*(np.concatenate(part) for part in (times, states, insides, helds)))
                times, states, insides, helds, waiting = [], [], [], [], 0
            if self.failure:
                break
        self.events += self.detector.finish(float(found.t_end), self.failure)

    def _control(self, t: float, y: Array, inside: float) -> None:
        """Let the sampled controller read the sensors and set the held torque."""
        loop = self.loop
        assert loop is not None
        if abs(t / loop.period_s - round(t / loop.period_s)) > 1e-6:
            return
        rows = self.observer.samples(np.array([t]), y[None, :], np.array([inside]))
        now = self.observer.state_table(np.array([t]), y[None, :], np.array([inside]), rows)
        self._recent = _extended(self._recent, now, t - self.observer.memory)
        readings = {name: float(column.values[-1]) for name, column in now.columns.items()}
        for name, column in self.observer.sensed(self._recent, np.array([t])).items():
            readings[name.removeprefix("measured_")] = float(column.values[-1])
        self.model.system.reals[loop.place] = loop.controller.update(t, readings)

    def _block(self, times: Array, states: Array, inside: Array, held: Array) -> dict[str, Table]:
        """The tables of a block of samples, audited and searched for events."""
        tables, rows = self.tables(times, states, inside, held)
        least, part = self.observer.least_heat(rows)
        self.audit.add(tables["state"], least, part, self.model.heat_accounts)
        self.events += self.detector.feed(tables, self.audit.exchanged, self.statistics)
        self.events += self.detector.friction(float(times[-1]), self.audit.gave_back)
        return tables

    def tables(
        self, times: Array, states: Array, inside: Array, held: Array
    ) -> tuple[dict[str, Table], Array]:
        """The tables of a block of samples that follows the one before, and the scratch at each sample.

        Args:
            times: shape (m,), s.
            states: shape (m, n).
            inside: shape (m,), a time within each sample's smooth span.
            held: shape (m,), torque that a sampled controller held at each sample, N m.
        """
        if self.loop is None:
            rows = self.observer.samples(times, states, inside)
        else:
            now = self.model.system.reals[self.loop.place]
            rows = self.observer.samples(times, states, inside, held, self.loop.place)
            self.model.system.reals[self.loop.place] = now
        table = self.observer.state_table(times, states, inside, rows)
        tables = {"state": table}
        if self.model.sensors:
            self._history = _extended(self._history, table, times[0] - self.observer.memory)
            table.columns.update(self.observer.sensed(self._history, times))
        if self.teeth_every and self.model.teeth is not None:
            chosen = np.round(times * self.sample_rate_hz).astype(int) % self.teeth_every == 0
            if chosen.any():
                tables["teeth"] = self.observer.teeth_table(times[chosen], rows[chosen])
        return tables, rows

    def _fail(self, found: Any) -> None:
        """Record why the integration stopped."""
        self.interrupted = found.exception if isinstance(found.exception, KeyboardInterrupt) else None
        self.failure, self.reached_s = told(self.model, found), float(found.t_end)
        self.events.append(Event(found.t_end, "error", "solver", self.failure))

    def static(self) -> dict[str, Column]:
        """What does not change in time: gaps and pitch errors of the teeth."""
        teeth = self.model.teeth
        if teeth is None:
            return {}
        return {
            "tooth_half_gap": Column(teeth.half_gaps_m, "m", "average half-gap of each tooth"),
            "tooth_pitch_error": Column(teeth.pitch_errors_m, "m", "pitch error of each tooth"),
        }

    def record(self, on_time: Callable[[float], object] | None = None) -> Recording:
        """Run to the end and keep everything in memory."""
        parts: dict[str, list[Table]] = {}
        for tables in self.blocks(on_time):
            for name, table in tables.items():
                parts.setdefault(name, []).append(table)
        return Recording(
            tables={name: joined(tables) for name, tables in parts.items()},
            static=self.static(),
            events=list(self.events),
        )


def joined(tables: list[Table]) -> Table:
    """Consecutive tables as one."""
    if len(tables) == 1:
        return tables[0]
    first = tables[0]
    columns = {
        name: Column(np.concatenate([t[name] for t in tables]), column.unit, column.description)
        for name, column in first.columns.items()
    }
    return Table(np.concatenate([t.time for t in tables]), columns)


def _extended(before: Table | None, now: Table, since: float) -> Table:
    """``before`` and ``now`` as one table without what is older than one sample before ``since`` (s)."""
    if before is None:
        return Table(now.time, dict(now.columns))
    first = max(0, int(np.searchsorted(before.time, since)) - 1)
    columns = {
        name: Column(np.concatenate([before[name][first:], column.values]), column.unit, column.description)
        for name, column in now.columns.items()
        if name in before
    }
    return Table(np.concatenate([before.time[first:], now.time]), columns)
