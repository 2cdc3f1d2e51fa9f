"""Other people's recordings as ours: mapped, in SI units, on the right side of the gear, one time axis."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log import foreign, naming
from hdsim.log.clock import seconds, spread
from hdsim.log.mapping import (
    MEASURED,
    AngleChannel,
    Channels,
    IntervalMask,
    Mapping,
    Origin,
    TorqueChannel,
    _Channel,
    side_of,
)
from hdsim.log.mapping_source import mapping_of
from hdsim.log.outliers import outliers
from hdsim.log.readers.contract import Numbers, Tell, silent
from hdsim.log.readers.topics import Samples
from hdsim.recording import Column, Event, Recording, Table

Array = NDArray[np.float64]
#: Finds the numbers that a mapping names, by topic.
Reader = Callable[[Path, Mapping, Sequence[Origin], Tell], dict[str, Samples]]

_TOLD_GAPS = 50
#: What the name of another joint begins with, beside the channels.
_JOINT = "joint "


def import_recording(
    path: str | Path,
    mapping: str | Path | dict[str, Any] | Mapping | None = None,
    tell: Tell = silent,
) -> Recording:
    """Read a measured recording into the names and units of our own.

    Args:
        path: a file of one of the formats of `hdsim.log.readers`, or a ROS 2 bag (its folder).
        mapping: a mapping's file, the same as a dictionary, or a mapping; None for a log of hdsim, which
            needs none.
        tell: hears which share of the file has been read.

    Returns:
        A recording whose ``state`` holds, as far as mapped, ``motor_angle``, ``motor_velocity``,
        ``motor_torque``, ``output_angle``, ``output_velocity``, ``output_torque``, ``load_torque`` and
        ``temperature``; ``transmission_error`` where both angles and the ratio are known.
        Masked numbers are NaN. Time counts from the first sample. The metadata hold the source, its SHA-256,
        the mapping, the ratio, and under ``gaps`` the gaps as JSON, [[start, end], ...] in s.

    Raises:
        InputError: the mapping is wrong (with file and line), does not fit the file, or the file is damaged.
    """
    path = Path(path)
    if mapping is None:
        if path.suffix != ".mcap":
            raise InputError(
                f"{path}: only a log of hdsim (.mcap) needs no mapping; name one (--mapping MAP.yaml)"
            )
        from hdsim.log.reader import open_log

        return open_log(path)
    return Import(path, mapping_of(mapping), tell).recording()


class Import:
    """One recording on its way; ``read`` finds numbers as `foreign.read` does."""

    def __init__(
        self, path: Path, mapping: Mapping, tell: Tell = silent, read: Reader = foreign.read
    ) -> None:
        self.path = path
        self.mapping = mapping
        self.tell = tell
        self._read = read
        self.events: list[Event] = []
        self._first_ns: int | None = None

    def recording(self) -> Recording:
        """The whole recording."""
        mapping = self.mapping
        given = mapping.channels.given()
        joints: dict[str, _Channel] = {_JOINT + name: channel for name, channel in mapping.joints.items()}
        given |= joints
        time, raw = self._samples(given)
        start = time[0]
        time = time - start
        for name, channel in given.items():
            if raw[name].dtype.kind == "M":
                raise InputError(f"{self.path}: {name}: column {channel.column!r} holds dates, no numbers")
        columns = {name: self._convert(name, channel, raw[name]) for name, channel in given.items()}
        masked = self._mask(time, columns)
        if mapping.ratio is not None and {"motor_angle", "output_angle"} <= set(columns):
            columns["transmission_error"] = columns["output_angle"] - columns["motor_angle"] / mapping.ratio
        gaps = self._gaps(time)
        self._tell(given, masked)
        turned = {name: columns.pop(name) for name in joints}
        tables = {"state": Table(time, {name: _column(name, values) for name, values in columns.items()})}
        if turned:
            named = {name.removeprefix(_JOINT): Column(v, "rad", "measured") for name, v in turned.items()}
            tables["joints"] = Table(time, named)
        return Recording(
            tables,
            events=sorted(self.events, key=lambda event: event.time),
            metadata=self._metadata(float(start), gaps),
        )

    def _samples(self, given: dict[str, _Channel]) -> tuple[Array, dict[str, Array]]:
        """Times in s and recorded numbers of every channel, one row a sample."""
        mapping, clock = self.mapping, self.mapping.time
        origins = {name: _origin(channel) for name, channel in given.items()}
        wanted = [*origins.values(), *(select.origin for select in mapping.select)]
        time_origin = None
        if clock.column is not None or clock.field is not None:
            time_origin = Origin(column=clock.column, topic=clock.topic, field=clock.field)
            wanted.append(time_origin)
        found = self._read(self.path, mapping, list(dict.fromkeys(wanted)), self.tell)
        lead = clock.topic or next(iter(origins.values())).topic or ""
        if lead not in found:
            raise InputError(f"{self.path}: the time's topic {lead!r} gives no channel: name a field of it")
        times = {}
        # The leading topic first: the others count from its first stamp.
        for topic, samples in sorted(found.items(), key=lambda item: item[0] != lead):
            own = time_origin is not None and (topic == lead)
            recorded = samples.values[time_origin] if own and time_origin is not None else None
            times[topic] = self._time(topic, samples, recorded, leads=topic == lead)
        time = times[lead]
        rows = {
            origin: values if topic == lead else _at(time, times[topic], values)
            for topic, samples in found.items()
            for origin, values in samples.values.items()
        }
        keep = np.ones(len(time), bool)
        for select in mapping.select:
            values = rows[select.origin]
            keep &= (values >= select.at_least) & (values <= select.at_most)
        if not keep.any():
            raise InputError(f"{self.path}: no row meets the mapping's select")
        return time[keep], {name: rows[origin][keep] for name, origin in origins.items()}

    def _time(self, topic: str, samples: Samples, recorded: Numbers | None, *, leads: bool) -> Array:
        """Times of the samples of a topic, in s, strictly increasing."""
        clock = self.mapping.time
        place = f"{self.path}: {topic}" if topic else str(self.path)
        count = len(next(iter(samples.values.values())))
        if count < 2:
            raise InputError(
                f"{place}: " + ("one sample is no recording" if count else "it is empty: no sample")
            )
        if clock.rate_hz is not None:
            return np.arange(count) / clock.rate_hz
        if recorded is not None:
            time = seconds(recorded, clock.unit or "s", clock.wraps_at, place)
        elif topic:
            time = self._stamped(samples, place, leads)
        else:
            raise InputError(f"{place}: the mapping's time names neither a column nor a rate_hz")
        bad = np.flatnonzero(~np.isfinite(time))
        if len(bad):
            raise InputError(f"{place}: sample {bad[0] + 1} has no time")
        if clock.quantised:
            return spread(time, place)
        back = np.flatnonzero(np.diff(time) <= 0)
        if len(back):
            k = int(back[0])
            raise InputError(
                f"{place}: time does not increase: sample {k + 2} at {time[k + 1]:.9g} s follows "
                f"{time[k]:.9g} s ({len(back)} such places). Sort or cut the recording; a clock coarser than "
                f"the samples needs `quantised: true`, a counter that starts anew `wraps_at`"
            )
        return time

    def _stamped(self, samples: Samples, place: str, leads: bool) -> Array:
        """Stamps of messages in s, counted from the first of all topics, which keeps them exact to 1 ns."""
        kind = self.mapping.time.stamp
        stamps = samples.stamps.get(kind)
        if stamps is None:
            if leads:
                raise InputError(f"{place}: its messages have no {kind} stamp")
            stamps = samples.stamps["log"]
        if self._first_ns is None:
            self._first_ns = int(stamps[0])
        return np.asarray(1e-9 * (stamps - self._first_ns), np.float64)

    def _convert(self, name: str, channel: _Channel, raw: Array) -> Array:
        """Recorded numbers in SI units on the channel's own side.

        An angle at the output times the ratio is the angle of the motor; torque goes the other way, because
        the power is the same.
        """
        values: Array = np.asarray(channel.si(raw), np.float64)
        if isinstance(channel, AngleChannel) and channel.unwrap:
            sound = np.isfinite(values)
            values = values.copy()
            values[sound] = np.unwrap(values[sound])
        side, own = getattr(channel, "side", None) or side_of(name), side_of(name)
        if side == own:
            return values
        ratio = self.mapping.ratio
        assert ratio is not None  # the mapping has been checked for it
        to_motor = own == "motor"
        if isinstance(channel, TorqueChannel):
            return values / ratio if to_motor else values * ratio
        return values * ratio if to_motor else values / ratio

    def _mask(self, time: Array, columns: dict[str, Array]) -> dict[str, int]:
        """Set what the masks name to NaN; returns how many numbers of each channel."""
        masked = {name: np.zeros(len(time), bool) for name in columns}
        for mask in self.mapping.masks:
            for name in mask.channels or tuple(columns):
                if isinstance(mask, IntervalMask):
                    masked[name] |= (time >= mask.start_s) & (time <= mask.end_s)
                else:
                    masked[name] |= outliers(columns[name], mask)
        for name, where in masked.items():
            columns[name] = np.where(where, np.nan, columns[name])
        return {name: int(where.sum()) for name, where in masked.items() if where.any()}

    def _gaps(self, time: Array) -> list[tuple[float, float]]:
        longest = self.mapping.longest_gap_s
        if longest is None:
            return []
        places = np.flatnonzero(np.diff(time) > longest)
        gaps = [(float(time[k]), float(time[k + 1])) for k in places]
        for start, end in gaps[:_TOLD_GAPS]:
            self.events.append(Event(start, "warning", "import", f"gap of {end - start:.6g} s"))
        if len(gaps) > _TOLD_GAPS:
            self.events.append(Event(gaps[_TOLD_GAPS][0], "warning", "import", f"{len(gaps)} gaps in all"))
        return gaps

    def _tell(self, given: dict[str, _Channel], masked: dict[str, int]) -> None:
        absent = [name for name in Channels.model_fields if name not in given]
        self.events.append(Event(0.0, "info", "import", f"imported {self.path.name}: {', '.join(given)}"))
        if absent:
            self.events.append(Event(0.0, "info", "import", f"not measured: {', '.join(absent)}"))
        for name, count in masked.items():
            self.events.append(Event(0.0, "info", "import", f"{count} samples of {name} masked"))

    def _metadata(self, start: float, gaps: list[tuple[float, float]]) -> dict[str, str]:
        from hdsim.scenario.writer import to_yaml

        found = {
            naming.ORIGIN_KEY: naming.MEASURED,
            "source": self.path.name,
            "mapping": to_yaml(self.mapping.model_dump(mode="json", exclude_defaults=True)),
            "start_of_time": f"{start!r} s" if self._first_ns is None else f"{self._first_ns} ns since 1970",
            "gaps": json.dumps(gaps),
        }
        if self._read is foreign.read and self.path.is_file():
            with open(self.path, "rb") as file:
                found["source_sha256"] = hashlib.file_digest(file, "sha256").hexdigest()
        if self.mapping.ratio is not None:
            found["ratio"] = repr(self.mapping.ratio)
        if self.mapping.description:
            found["description"] = self.mapping.description
        return found


def _at(time: Array, other: Array, values: Array) -> Array:
    """Numbers of another topic at the times of the leading one; NaN outside of its time."""
    found: Array = np.interp(time, other, values, left=np.nan, right=np.nan)
    return found


def _origin(channel: _Channel) -> Origin:
    return Origin(column=channel.column, topic=channel.topic, field=channel.field, joint=channel.joint)


def _column(name: str, values: Array) -> Column:
    if name == "transmission_error":
        return Column(values, "rad", "measured output angle less motor angle over ratio")
    return Column(values, MEASURED[name], "measured")


def write_imported(recording: Recording, path: str | Path) -> Path:
    """Write an imported recording as a log, with its mapping attached."""
    from hdsim.log.whole import write_log

    files: dict[str, Any] = {}
    if "mapping" in recording.metadata:
        files["mapping.yaml"] = recording.metadata["mapping"]
    return write_log(recording, path, attachments=files)
