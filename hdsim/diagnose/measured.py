"""Measured records: the contract's channels on their own clock, with a mask of what can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError

if TYPE_CHECKING:
    from hdsim.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: The contract's channels and their units.
CHANNELS = {
    "motor_angle": "rad",
    "motor_velocity": "rad/s",
    "motor_torque": "N m",
    "output_angle": "rad",
    "output_velocity": "rad/s",
    "output_torque": "N m",
    "load_torque": "N m",
    "temperature": "degC",
}
#: Fewest samples that a diagnosis can work with.
FEWEST_SAMPLES = 200


@dataclass
class Record:
    """One measured run.

    Args:
        name: where it comes from, for messages.
        time: shape (n,), s, from 0, strictly increasing.
        channels: shape (n,) each, SI units, by the contract's names.
        trusted: shape (n,) each: samples that are neither missing nor spikes.
    """

    name: str
    time: Array
    channels: dict[str, Array]
    trusted: dict[str, Mask] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for channel, values in self.channels.items():
            self.trusted.setdefault(channel, np.isfinite(values))

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def period_s(self) -> float:
        """Median time between samples, s."""
        return float(np.median(np.diff(self.time)))

    def filled(self, channel: str) -> Array:
        """A channel with untrusted samples replaced by linear interpolation, shape (n,)."""
        good = self.trusted[channel]
        if good.all():
            return self.channels[channel]
        return np.interp(self.time, self.time[good], self.channels[channel][good])


def record_from(recording: Recording, name: str = "") -> Record:
    """The contract's channels of a recording; a log of a simulated run gives what its sensors read.

    Raises:
        InputError: too few samples, a clock that does not run, or no channel of the contract.
    """
    time = np.asarray(recording.time, dtype=float)
    name = name or recording.metadata.get("scenario_name", "") or "measured"
    if len(time) < FEWEST_SAMPLES:
        raise InputError(f"{name}: {len(time)} samples, a diagnosis needs at least {FEWEST_SAMPLES}")
    if not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0):
        raise InputError(f"{name}: time must be finite and strictly increasing")
    channels = {}
    for channel in CHANNELS:
        source = f"measured_{channel}" if f"measured_{channel}" in recording else channel
        if source in recording:
            channels[channel] = np.asarray(recording[source], dtype=float)
    if not channels:
        raise InputError(f"{name}: no channel of {', '.join(CHANNELS)}; found {', '.join(recording)}")
    return Record(name, time - time[0], channels)
