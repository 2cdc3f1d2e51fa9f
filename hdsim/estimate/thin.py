"""Records with more readings than their channels need: means of successive readings in their place.

The mean over a stretch of time commutes with everything in a drive that is linear and does not change: the
model under the mean motion predicts the mean torques. What means lose is what is faster, so they are taken
only as far as what they lose of the compared channels is the noise, and hardly anything beside it; or hardly
anything beside what a model leaves, once that is known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdsim.estimate.noise import noise_floor
from hdsim.estimate.plan import LoadSource, Locked, plan_for
from hdsim.estimate.records import Array, Record

#: Readings that a mean may hold.
COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
#: Samples that are left of all records together: the most blocks of time that are told apart, 90, of about 90
#: samples each. The cost of a diagnosis is in proportion to them.
ENOUGH = 8000
#: Part of the noise's power that may be lost beside it: an effect has to explain as much of what is left to
#: be named. Noise by pairs of readings over noise by differences of high order, both squared, up to which it
#: counts as white: the estimates differ by up to 20 % where it is, and by 70 % and more on real machines.
OF_NOISE, WHITE = 0.03, 1.25
#: Part of what a model leaves of a channel beyond the noise that may be lost: half of the least that one more
#: effect must explain to be named beside those that are found (``BEYOND_GAIN`` of a search).
OF_LEFT = 0.0025
#: Readings of a mean that loses so little, over those of the mean that is taken: near their own limit means
#: no longer tell the course between them.
MARGIN = 2
#: Time that a mean may span, over what its readings promise; beyond it there is a gap.
GAP = 1.5


def thinned(record: Record, count: int) -> Record:
    """Means of that many successive readings; a mean counts where half of its readings do.

    Args:
        record: as it was read.
        count: readings of a mean.
    """
    if count < 2:
        return record
    whole = len(record.time) // count
    rows = slice(0, whole * count)

    def means(values: Array) -> Array:
        return np.asarray(values[rows].reshape(whole, count).mean(axis=1))

    stamps = record.time[rows].reshape(whole, count)
    close = stamps[:, -1] - stamps[:, 0] <= GAP * count * record.period_s
    channels, trusted = {}, {}
    for channel, good in record.trusted.items():
        values = record.filled(channel) if good.any() else record.channels[channel]
        channels[channel] = means(values)
        trusted[channel] = (means(good.astype(float)) >= 0.5) & close
    time = means(record.time)
    return Record(
        record.name, time - time[0], channels, trusted, record.ratio, source=record, readings=count,
        begins_s=record.begins_s + float(time[0]),
        joints={name: means(values) for name, values in record.joints.items()},
    )  # fmt: skip


class Means:
    """What means of successive readings do to a course that is smooth over each of them.

    The mean over readings whose stamps have the variance v is f + v f''/2, to the second order of their span.

    Args:
        record: its samples may be means or readings; readings are left as they are.
    """

    def __init__(self, record: Record) -> None:
        self._half: Array | None = None
        if record.readings > 1:
            whole = len(record.time)
            stamps = record.as_read.time[: whole * record.readings].reshape(whole, record.readings)
            self._half, self._time = 0.5 * stamps.var(axis=1), record.time

    def of(self, course: Array) -> Array:
        """Means of a course that is given at the samples' times, shape (n,)."""
        return course if self._half is None else course + self._lost(self._half, course)

    def behind(self, means: Array) -> Array:
        """The course at the samples' times of which these are the means, shape (n,)."""
        return means if self._half is None else means - self._lost(self._half, means)

    def _lost(self, half: Array, values: Array) -> Array:
        """Half the variance times the second derivative, divided differences; none at the ends."""
        apart = np.diff(self._time)
        bend = np.zeros(len(values))
        bend[1:-1] = 2.0 * np.diff(np.diff(values) / apart) / (apart[1:] + apart[:-1])
        return np.asarray(half * bend)


def readings_of_means(
    records: Sequence[Record],
    *,
    load: LoadSource | None = None,
    locked: Locked = "",
    left: Mapping[str, float] | None = None,
) -> int:
    """How many successive readings may be made one, 1 for none, of the record that is read fastest.

    Args:
        records: as they were read.
        load: see ``plan_for``.
        locked: likewise.
        left: mean square that a model leaves of each channel beyond the noise, SI units, once it is known.
    """
    beyond = left or {}
    samples = sum(len(record.time) for record in records)
    fastest = min(record.period_s for record in records)
    found = 1
    for count in COUNTS[1:]:
        if samples < count * ENOUGH:
            break
        for record in records:
            own = over(record, MARGIN * count * fastest)
            channels = plan_for(record, load=load, locked=locked).channels
            if own > 1 and any(not only_noise(record, c, own, beyond.get(c, 0.0)) for c in channels):
                return found
        found = count
    return found


def over(record: Record, span_s: float) -> int:
    """Readings of a record in a span of time, 1 or more."""
    return max(1, int(span_s / record.period_s + 0.01))


def only_noise(record: Record, channel: str, count: int, left: float = 0.0) -> bool:
    """Whether all that means of so many readings lose of a channel is white noise, or little beside the rest.

    Args:
        record: as it was read.
        channel: one that has readings.
        count: readings of a mean, 2 or more.
        left: mean square that a model leaves of the channel beyond the noise.
    """
    floor = noise_floor(record.channels[channel], record.trusted[channel]) ** 2
    # Of white noise a mean takes its own share along.
    noise = float(np.clip(2.0 * _lost(record, channel, 2), floor, WHITE * floor))
    lost = _lost(record, channel, count) - noise * (1.0 - 1.0 / count)
    return lost <= max(OF_NOISE * noise, OF_LEFT * left)


def _lost(record: Record, channel: str, count: int) -> float:
    """Mean square of what means of so many readings do not follow."""
    from scipy.interpolate import CubicSpline

    few = thinned(record, count)
    rows = len(few.time) * count
    course = CubicSpline(few.time + few.begins_s - record.begins_s, few.channels[channel])(record.time[:rows])
    good = record.trusted[channel][:rows]
    return float(np.mean((record.filled(channel)[:rows] - course)[good] ** 2))
