"""Measured records: the contract's channels on their own clock, with a mask of what can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.mapping import MEASURED

if TYPE_CHECKING:
    from hdsim.recording import Recording, Table

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Fewest samples, and shortest record, that a diagnosis can work with.
FEWEST_SAMPLES, SHORTEST_S = 200, 0.5
_WHY_SO_LONG = (
    "its start is not compared, a third is held out for validation, and the rest is cut into 18 blocks"
)
#: Least part of its samples that a record has to have, of those that its rate and its duration promise.
SPARSEST = 0.1
#: Larger numbers than this, in SI units, are no measurement of a drive, and their squares overflow.
LARGEST = 1e12


@dataclass
class Record:
    """One measured run.

    Args:
        name: where it comes from, for messages.
        time: shape (n,), s, from 0, strictly increasing.
        channels: shape (n,) each, SI units, by the contract's names.
        trusted: shape (n,) each: samples that are neither missing nor spikes.
        ratio: the ratio by which an import brought numbers to the other side of the gear, where it did.
        source: the record as it was read, where this one has means of its readings.
        readings: that a sample is the mean of.
        begins_s: time of the first sample in the source, s.
        joints: angles of other joints of the same machine by name, shape (n,) each, rad.
    """

    name: str
    time: Array
    channels: dict[str, Array]
    trusted: dict[str, Mask] = field(default_factory=dict)
    ratio: float | None = None
    source: Record | None = None
    readings: int = 1
    begins_s: float = 0.0
    joints: dict[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for channel, values in self.channels.items():
            self.trusted.setdefault(channel, np.isfinite(values) & (np.abs(values) < LARGEST))

    def keep(self, rows: Mask) -> None:
        """Leave out all other rows, which hold no reading of their own.

        Args:
            rows: shape (n,), the first among them.
        """
        self.time = self.time[rows]
        self.channels = {channel: values[rows] for channel, values in self.channels.items()}
        self.trusted = {channel: good[rows] for channel, good in self.trusted.items()}
        self.joints = {joint: angle[rows] for joint, angle in self.joints.items()}

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def period_s(self) -> float:
        """Median time between samples, s."""
        return float(np.median(np.diff(self.time)))

    @property
    def as_read(self) -> Record:
        """The record before any means were taken."""
        return self.source or self

    @property
    def readable(self) -> set[str]:
        """Channels with more than a few readings that can be trusted."""
        return {c for c, good in self.trusted.items() if good.sum() > 20}

    def rate(self, angle: str) -> tuple[Array, Mask] | None:
        """The measured velocity of an angle's side with its trusted samples, (n,) each; None without one."""
        velocity = angle.replace("_angle", "_velocity")
        if velocity not in self.readable or np.ptp(self.filled(velocity)) == 0.0:
            return None
        return self.filled(velocity), self.trusted[velocity]

    def filled(self, channel: str) -> Array:
        """A channel with untrusted samples replaced by linear interpolation, shape (n,)."""
        good = self.trusted[channel]
        if good.all():
            return self.channels[channel]
        return np.interp(self.time, self.time[good], self.channels[channel][good])


def long_enough(time: Array) -> bool:
    """Whether a diagnosis can work with samples at these times, s, shape (n,)."""
    return len(time) >= FEWEST_SAMPLES and float(np.ptp(time)) >= SHORTEST_S


def record_from(recording: Recording, name: str = "") -> Record:
    """The contract's channels of a recording; a log of a simulated run gives what its sensors read.

    Raises:
        InputError: too short, a clock that does not run, or no channel of the contract.
    """
    time = np.asarray(recording.time, dtype=float)
    name = name or recording.metadata.get("scenario_name", "") or "measured"
    if not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0):
        raise InputError(f"{name}: time must be finite and strictly increasing")
    lasts = float(np.ptp(time)) if len(time) else 0.0
    if not long_enough(time):
        raise InputError(
            f"{name}: {len(time)} samples over {lasts:.3g} s; a diagnosis needs at least {FEWEST_SAMPLES} "
            f"samples over {SHORTEST_S:g} s, because {_WHY_SO_LONG}. Is the unit of its time right?"
        )
    steps = np.diff(time)
    promised = lasts / float(np.median(steps))
    if len(time) < SPARSEST * promised:
        longest = int(np.argmax(steps))
        raise InputError(
            f"{name}: {len(time)} samples are {100 * len(time) / promised:.2g} % of what their rate and "
            f"{lasts:.4g} s promise (allowed: at least {100 * SPARSEST:g} %); the longest gap, "
            f"{steps[longest]:.4g} s, begins at {time[longest] - time[0]:.4g} s: cut the recording there and "
            "give the parts as records"
        )
    channels = {}
    for channel in MEASURED:
        source = f"measured_{channel}" if f"measured_{channel}" in recording else channel
        if source in recording:
            channels[channel] = np.asarray(recording[source], dtype=float)
    if not channels:
        raise InputError(f"{name}: no channel of {', '.join(MEASURED)}; found {', '.join(recording)}")
    joints = recording.tables.get("joints")
    others = {} if joints is None else {j: _whole(name, j, time, joints) for j in joints.columns}
    return Record(name, time - time[0], channels, ratio=_ratio(recording), joints=others)


def _whole(name: str, joint: str, time: Array, table: Table) -> Array:
    """A joint's angle at the record's times, what is missing interpolated."""
    values = np.asarray(table[joint], dtype=float)
    good = np.isfinite(values)
    if good.sum() < 2:
        raise InputError(f"{name}: joint {joint} has no angle that is a number")
    return np.asarray(np.interp(time, table.time[good], values[good]))


def _ratio(recording: Recording) -> float | None:
    try:
        return float(recording.metadata["ratio"])
    except (KeyError, ValueError):
        return None
