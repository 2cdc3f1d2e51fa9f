"""Which samples of a run a metric looks at: one-way turns, dwells, plateaus."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.outliers import runs_of
from hdsim.recording import Recording

Array = NDArray[np.float64]

#: Arcseconds in a radian.
ARCSEC = 180.0 * 3600.0 / math.pi


def stretches(mask: NDArray[np.bool_]) -> list[slice]:
    """Runs of true samples, in order."""
    return [slice(first, last) for first, last in runs_of(mask)]


def one_way_turn(recording: Recording, ratio: float, direction: int) -> slice:
    """The samples of the last steady turn of the output one way, at most one to spare at the start.

    Steady is where the motor's speed is above 80 % of its median on the way, so that starting and stopping
    are left out.

    Args:
        recording: a run.
        ratio: signed ratio motor angle / output angle.
        direction: +1 or -1, of the output.

    Raises:
        InputError: the output does not turn once that way at a steady speed.
    """
    speed = recording["motor_velocity"] * math.copysign(1.0, direction * ratio)
    angle = recording["motor_angle"]
    turn = 2.0 * math.pi * abs(ratio)
    longest = 0.0
    for way in reversed(stretches(speed > 0.0)):
        for part in reversed(stretches(speed[way] > 0.8 * np.median(speed[way]))):
            steady = slice(way.start + part.start, way.start + part.stop)
            travel = np.abs(angle[steady] - angle[steady.stop - 1])
            longest = max(longest, float(travel[0]))
            if travel[0] >= turn * (1.0 - 1e-9):
                first = int(np.flatnonzero(travel >= turn * (1.0 - 1e-9))[-1])
                return slice(steady.start + first, steady.stop)
    way_name = "positive" if direction > 0 else "negative"
    raise InputError(
        f"the transmission error needs one steady turn of the output in {way_name} direction; "
        f"the longest in this run is {longest / turn:.3g} turns"
    )


@dataclass(frozen=True)
class Dwell:
    """A rest of the commanded angle.

    Args:
        samples: where it is in the state table.
        target: commanded angle, rad.
        move: commanded distance of the move before it, rad, signed; 0 where the run begins at rest.
    """

    samples: slice
    target: float
    move: float

    @property
    def last(self) -> slice:
        """The last fifth of the dwell: where the axis counts as come to rest."""
        start, stop = self.samples.start, self.samples.stop
        return slice(stop - max(1, (stop - start) // 5), stop)

    def attained(self, angle: Array) -> float:
        """Mean of ``angle`` over the last fifth of the dwell."""
        return float(np.mean(angle[self.last]))


def dwells(recording: Recording, shortest_s: float = 0.05) -> list[Dwell]:
    """Every rest of the commanded angle that follows a move and lasts at least ``shortest_s``.

    Raises:
        InputError: the run has no commanded angle, or no dwell after a move.
    """
    found = [dwell for dwell in rests(recording, shortest_s) if dwell.move]
    if not found:
        raise InputError("positioning needs a dwell after a move; the commanded angle never rests after one")
    return found


def rests(recording: Recording, shortest_s: float = 0.05) -> list[Dwell]:
    """Every rest of the commanded angle that lasts at least ``shortest_s``, the one at the start too.

    Raises:
        InputError: the run has no commanded angle.
    """
    if "reference_angle" not in recording:
        raise InputError("positioning needs a commanded angle: drive the motor with a position command")
    reference, time = recording["reference_angle"], recording.time
    still = np.abs(np.diff(reference, prepend=reference[0])) < 1e-10
    found: list[Dwell] = []
    before = reference[0]
    for part in stretches(still):
        if time[part.stop - 1] - time[part.start] < shortest_s:
            continue
        target = float(reference[part.stop - 1])
        move = target - before if abs(target - before) > 1e-8 else 0.0
        if move or not found:
            # The sample before is the one at which the command arrived.
            found.append(Dwell(slice(max(0, part.start - 1), part.stop), target, move))
        before = target
    return found


@dataclass(frozen=True)
class Plateau:
    """A stretch of constant motor speed and load torque, its first part left out.

    Args:
        samples: where it is in the state table: a whole number of motor turns, if there is one.
        speed: motor speed, rad/s, signed.
        load: external torque on the output, N m, signed.
    """

    samples: slice
    speed: float
    load: float


def plateaus(recording: Recording, settle: float = 0.4, shortest_s: float = 0.05) -> list[Plateau]:
    """Stretches of constant speed and load, in order; the first share ``settle`` of each is left out."""
    time, speed, load = recording.time, recording["motor_velocity"], recording["load_torque"]
    if len(time) < 2:
        return []
    fast = np.max(np.abs(speed), initial=0.0)
    strong = np.max(np.abs(load), initial=0.0)
    step = np.gradient(time)
    calm = np.abs(np.gradient(speed)) <= np.abs(speed) * step
    calm &= np.abs(np.gradient(load)) <= 1e-6 * strong + 1e-12
    calm &= np.abs(speed) > 1e-3 * fast
    found = []
    for part in stretches(calm):
        if time[part.stop - 1] - time[part.start] < shortest_s:
            continue
        first = part.start + math.ceil(settle * (part.stop - part.start))
        turns = np.abs(recording["motor_angle"][first : part.stop] - recording["motor_angle"][first])
        whole = np.floor(turns[-1] / (2.0 * math.pi)) * 2.0 * math.pi
        last = part.stop if whole == 0.0 else first + int(np.searchsorted(turns, whole)) + 1
        kept = slice(first, min(last, part.stop))
        found.append(Plateau(kept, float(np.mean(speed[kept])), float(np.mean(load[kept]))))
    return found
