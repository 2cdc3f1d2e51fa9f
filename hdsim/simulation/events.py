"""What happens in a run, told in words: moves, limits, lost contact, saturation, doubtful solutions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive.ratings import ratings_of_preset
from hdsim.recording import Event
from hdsim.simulation.limit_cycle import RestWatch
from hdsim.simulation.limits import Bearing, speed_watches, torque_watches
from hdsim.simulation.quota import Quota
from hdsim.simulation.watches import CROSSED, Flanks, Watch

if TYPE_CHECKING:
    from hdsim.drive.model import Model
    from hdsim.recording import Table
    from hdsim.simulation.solvers import Statistics

Array = NDArray[np.float64]

#: Share of the rated torque below which a flank counts as unloaded.
UNLOADED = 1e-3
#: Refused steps in a block below which nothing is said.
FEW_STEPS = 100
#: Share of the exchanged energy that the audit's residual may reach before it is a doubt.
DOUBT = 1e-3


@dataclass
class EventDetector:
    """Finds the events of a run in the blocks of its tables.

    Of each kind (a condition's beginning and end, else a source and the words that don't depend on numbers)
    as many are told as a `Quota` allows.

    Args:
        model: the model that runs.
        duration: length of the run, s.
    """

    model: Model
    duration: float
    _quotas: dict[tuple[str, str], Quota] = field(default_factory=dict)
    _reference: tuple[float, float] | None = None
    _moving: bool | None = None
    _steps: int = 0
    _rejected: int = 0
    _told_friction: bool = False
    _rests: RestWatch = field(default_factory=RestWatch)

    def __post_init__(self) -> None:
        rated = self.model.rated_torque_nm
        margin = 0.98
        self._output = [
            Watch(
                "drive",
                "warning",
                f"rated torque of {rated:.4g} N m exceeded",
                "torque below the rated one again",
                rated * (1 + 1e-3),
                rated * margin,
            )
        ]
        gear = ratings_of_preset(self.model.drive.preset)
        self._output += [] if gear is None else torque_watches(gear, margin)
        self._input = [] if gear is None else speed_watches(gear, margin)
        self._bearing = None if gear is None or gear.rated_torque is None else Bearing(gear)
        self._flanks = Flanks(UNLOADED * rated)
        limit = torque_limit(self.model)
        self._limited_torque = bool(np.isfinite(limit))
        self._saturation = Watch(
            "motor",
            "warning",
            f"torque at its limit of {limit:.4g} N m",
            "torque below its limit again",
            limit * (1 - 1e-9),
            limit * (1 - 1e-3),
        )
        self._idle = Watch("mesh", "info", "no tooth carries load", "teeth carry load again", -1e-12, -1e-9)
        self._doubt = Watch(
            "solver", "warning", "energy audit off by {value:.1e} of the energy exchanged", "", DOUBT, 0.0
        )
        engagement = getattr(self.model.drive.mesh, "engagement", None)
        self._share: Watch | None = None
        if engagement is not None:
            share = engagement.share
            self._share = Watch(
                "mesh",
                "info",
                f"more teeth engaged than the {100 * share:.3g} % at rated torque",
                "no more teeth engaged than at rated torque",
                share * (1 + 1e-2),
                share * (1 + 1e-6),
            )
        self._force: Watch | None = None
        if self.model.teeth is not None:
            # The contact law is tabulated to twenty times this force and goes on in a straight line.
            end = 20 * self.model.teeth.rated_tooth_force_n
            self._force = Watch(
                "contact",
                "warning",
                f"tooth force beyond the contact table's {end:.4g} N",
                "",
                end,
                0.5 * end,
            )
        watches = [*self._output, *self._input, self._saturation, self._idle, self._doubt]
        watches += [watch for watch in (self._share, self._force) if watch is not None]
        self._begins = {(watch.source, _words(watch.begins)): watch for watch in watches}
        self._ends = {(watch.source, watch.ends): watch for watch in watches if watch.ends}

    def start(self, method: str) -> list[Event]:
        """The event of the beginning."""
        return [Event(0.0, "info", "run", f"run begins: {self.duration:g} s by {method}")]

    def feed(self, tables: dict[str, Table], exchanged: float, work: Statistics) -> list[Event]:
        """Events of a block, in the order of time.

        Args:
            tables: the block.
            exchanged: energy that has gone through the drive so far, J.
            work: of the solver so far.
        """
        state = tables["state"]
        time = state.time
        found: list[Event] = []
        if not len(time):
            return found
        found += self._phases(state)
        steps, rejected = work.steps - self._steps, work.rejected - self._rejected
        self._steps, self._rejected = work.steps, work.rejected
        if rejected > max(steps, FEW_STEPS):
            text = f"hard to integrate: {rejected} steps refused, {steps} taken up to {time[-1]:.6g} s"
            found.append(Event(float(time[0]), "warning", "solver", text))
        torque = state["output_torque"]
        for watch in self._output:
            found += watch.feed(time, np.abs(torque))
        if "motor_velocity" in state:
            speed = state["motor_velocity"]
            for watch in self._input:
                found += watch.feed(time, np.abs(speed))
            if self._bearing is not None:
                self._bearing.feed(time, torque, speed)
        found += self._flanks.feed(time, torque)
        if self._limited_torque:
            found += self._saturation.feed(time, np.abs(state["motor_torque"]))
        if "engaged_share" in state:
            found += self._idle.feed(time, -state["engaged_share"])
            if self._share is not None:
                found += self._share.feed(time, state["engaged_share"])
        if exchanged > 0:
            found += self._doubt.feed(time, np.abs(state["energy_residual"]) / exchanged)
        if self._force is not None and "teeth" in tables:
            teeth = tables["teeth"]
            found += self._force.feed(teeth.time, np.abs(teeth["normal_force"]).max(axis=1))
        return self._limited(found, float(time[-1]))

    def friction(self, time: float, part: str) -> list[Event]:
        """The event of a friction or damping that gives energy back, once.

        Args:
            time: of the last sample, s.
            part: its name; none: "".
        """
        if not part or self._told_friction:
            return []
        self._told_friction = True
        text = f"energy from nothing: {part} gives back heat, which no friction can; do not trust this run"
        return [Event(time, "error", "solver", text)]

    def finish(self, time: float, failure: str | None) -> list[Event]:
        """The last events: what was not told singly, and the end.

        Args:
            time: time that was reached, s.
            failure: why the run stopped early, or None.
        """
        found = self._limited(list(self._rests.end()), time)
        found += [event for quota in self._quotas.values() for event in quota.finish(time)]
        if self._bearing is not None:
            found += self._bearing.told(time)
        if failure is None:
            found.append(Event(time, "info", "run", "run ends"))
        return found

    def _phases(self, state: Table) -> list[Event]:
        """Moves and dwells of the commanded motion."""
        if "reference_angle" in state:
            angle = state["reference_angle"]
        elif "motor" in self.model.motions:
            angle = state["motor_angle"] / self.model.ratio
        else:
            return []
        time = state.time
        first = (float(time[0]), float(angle[0])) if self._reference is None else self._reference
        times, angles = np.append(first[0], time), np.append(first[1], angle)
        self._reference = (float(time[-1]), float(angle[-1]))
        # Trajectories rest to the last bit; the threshold is rounding of their polynomials.
        moves = np.abs(np.diff(angles)) > 1e-13 * max(1.0, float(np.abs(angles).max()))
        if len(time) == 1 and times[0] == times[1]:
            return []
        if times[0] == times[1]:
            times, angles, moves = times[1:], angles[1:], moves[1:]
        found: list[Event] = []
        if "tracking_error" in state:
            told = slice(len(time) - len(moves), None)
            found += self._rests.feed(time[told], state["tracking_error"][told], ~moves)
        for k in np.flatnonzero(
            np.diff(moves.astype(int), prepend=-1 if self._moving is None else int(self._moving))
        ):
            what = "moves" if moves[k] else "rests"
            where = f"{np.degrees(angles[k]) + 0.0:.6g} deg"
            found.append(Event(float(times[k]), "info", "command", f"command {what} at {where}"))
        self._moving = bool(moves[-1])
        return found

    def _limited(self, events: list[Event], upto: float) -> list[Event]:
        """What the quotas tell of a block's events, in the order of time."""
        by_quota: dict[int, list[Event]] = {}
        for event in sorted(events, key=lambda event: event.time):
            by_quota.setdefault(id(self._quota(event)), []).append(event)
        told = [e for quota in self._quotas.values() for e in quota.feed(by_quota.get(id(quota), []), upto)]
        return sorted(told, key=lambda event: event.time)

    def _quota(self, event: Event) -> Quota:
        kind, ends = _words(event.message), ""
        watch = self._ends.get((event.source, event.message)) or self._begins.get((event.source, kind))
        if watch is not None:
            ends = watch.ends
            kind = _words(watch.begins) if "{" in watch.begins else watch.begins
        elif kind.startswith(CROSSED):
            kind = CROSSED
        return self._quotas.setdefault((event.source, kind), Quota(kind, self.duration, ends))


def _words(message: str) -> str:
    """The words of a message that don't depend on numbers."""
    return " ".join(word for word in message.split() if not any(c.isdigit() for c in word))


def torque_limit(model: Model) -> float:
    """Torque limit of the motor's controller, N m; infinite for none."""
    for part in model.parts:
        limit = getattr(getattr(part, "motor", None), "torque_limit_nm", None)
        if limit is not None:
            return float(limit)
    return float(np.inf)
