"""``/joint_states``: the drive as the robot world's ``sensor_msgs/msg/JointState``, in CDR.

Joints ``motor`` and ``output``, each with position (rad), velocity (rad/s) and effort (N m; motor torque, and
torque of the drive on the output). The names never change, so all messages have the same bytes but for the
time stamp and the numbers, and numpy fills whole Message records as it does for tables.

Message: https://docs.ros2.org/latest/api/sensor_msgs/msg/JointState.html. Encoding: OMG DDS-RTPS, plain CDR,
little-endian (https://mcap.dev/spec/registry#cdr); doubles are aligned to 8 bytes from the end of its head.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap import records
from mcap.opcode import Opcode
from numpy.typing import NDArray

from hdsim.log import naming
from hdsim.log.rows import HEAD
from hdsim.log.streams import Stream

if TYPE_CHECKING:
    from hdsim.log.container import Container

    Array = naming.Array

TOPIC = "/joint_states"
MESSAGE_TYPE = "sensor_msgs/msg/JointState"
JOINTS = ("motor", "output")
_FRAME = "world"
_FIELDS = ("angle", "velocity", "torque")
_MOST_ROWS = 4096

SCHEMA = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def has_joints(columns: Sequence[str]) -> bool:
    """Whether a table with these columns says where a joint is."""
    return any(f"{joint}_angle" in columns for joint in JOINTS)


class _Layout:
    """Where the bytes of a message lie: ``dtype`` over a whole Message record, and what is constant in it."""

    def __init__(self, joints: Sequence[str]) -> None:
        head = HEAD.size
        body = bytearray(b"\x00\x01\x00\x00")  # plain CDR, little-endian

        def align(size: int) -> None:
            body.extend(bytes(-(len(body) - 4) % size))

        def text(value: str) -> None:
            align(4)
            data = value.encode() + b"\0"
            body.extend(struct.pack("<I", len(data)) + data)

        names, formats, offsets = ["sec", "nanosec"], ["<i4", "<u4"], [head + 4, head + 8]
        body += bytes(8)
        text(_FRAME)
        align(4)
        body += struct.pack("<I", len(joints))
        for joint in joints:
            text(joint)
        arrays: list[Any] = [*formats]
        for field in _FIELDS:
            align(4)
            body += struct.pack("<I", len(joints))
            align(8)
            names.append(field)
            arrays.append(("<f8", (len(joints),)))
            offsets.append(head + len(body))
            body += bytes(8 * len(joints))
        names += ["channel", "sequence", "log_time", "publish_time"]
        arrays += ["<u2", "<u4", "<u8", "<u8"]
        offsets += [9, 11, 15, 23]
        record = HEAD.pack(Opcode.MESSAGE, HEAD.size - 9 + len(body), 0, 0, 0, 0) + body
        self.size = len(record)
        self.template: NDArray[np.uint8] = np.frombuffer(record, np.uint8)
        self.dtype = np.dtype({"names": names, "formats": arrays, "offsets": offsets, "itemsize": self.size})


class JointStateStream(Stream):
    """Samples of a table as JointState messages: the first row at or after each tick, and nothing in between.

    Unlike the view it holds real samples, because whoever reads joint states takes each for one instant.
    A quantity that the table lacks is NaN.

    Args:
        container: where finished chunks go.
        channel: channel id.
        schema_id: schema id.
        rate: messages a second at most; infinite keeps every row.
    """

    def __init__(self, container: Container, channel: int, schema_id: int, rate: float) -> None:
        schema = records.Schema(id=schema_id, name=MESSAGE_TYPE, encoding="ros2msg", data=SCHEMA.encode())
        super().__init__(container, channel, TOPIC, schema, {}, encoding="cdr")
        self._rate = rate
        self._layout = _Layout(JOINTS)
        self._next = -np.inf
        self._waiting: list[NDArray[Any]] = []
        self._rows = 0

    def feed(self, time: Array, columns: Mapping[str, Array]) -> None:
        """Take the next rows of the table: time (n,) in s, columns (n,) by name."""
        chosen = self._choose(time)
        if not len(chosen):
            return
        data = np.empty((len(chosen), self._layout.size), np.uint8)
        data[:] = self._layout.template
        rows = data.view(self._layout.dtype)[:, 0]
        times = naming.to_ns(time[chosen])
        rows["channel"] = self._channel.id
        rows["sequence"] = np.arange(self._sequence, self._sequence + len(chosen)) & 0xFFFFFFFF
        rows["log_time"] = rows["publish_time"] = times
        rows["sec"], rows["nanosec"] = times // 1_000_000_000, times % 1_000_000_000
        for field in _FIELDS:
            for k, joint in enumerate(JOINTS):
                name = f"{joint}_{field}"
                rows[field][:, k] = columns[name][chosen] if name in columns else np.nan
        self._sequence += len(chosen)
        self._tell(times, data, HEAD.size)
        self._waiting.append(data)
        self._rows += len(chosen)
        while self._rows >= _MOST_ROWS:
            self._put(_MOST_ROWS)

    def _choose(self, time: Array) -> NDArray[np.intp]:
        if not np.isfinite(self._rate):
            return np.arange(len(time))
        slot = np.floor(time * self._rate * (1 + 1e-12))
        fresh = np.diff(slot, prepend=self._next) > 0
        if len(slot):
            self._next = float(slot[-1])
        return np.flatnonzero(fresh)

    def flush(self) -> None:
        """Write the messages that wait."""
        if self._rows:
            self._put(self._rows)

    def _put(self, count: int) -> None:
        """Write the first ``count`` messages, whatever the blocks they came in."""
        whole = np.concatenate(self._waiting)
        now, later = whole[:count], whole[count:]
        head = len(self._preamble)
        offsets = head + self._layout.size * np.arange(count, dtype=np.int64)
        times = np.ascontiguousarray(now.view(self._layout.dtype)[:, 0]["log_time"])
        self._write(self._preamble + now.tobytes(), times, offsets)
        self._waiting, self._rows = ([later] if len(later) else []), len(later)


class JointStates:
    """The joint states of the first table that has joints.

    Args:
        make: makes their topic, once there is such a table.
    """

    def __init__(self, make: Callable[[], JointStateStream]) -> None:
        self._make = make
        self._table = ""
        self._stream: JointStateStream | None = None

    def feed(self, table: str, time: Array, columns: Mapping[str, Array]) -> None:
        """Take the next rows of a table."""
        if table not in naming.RUN_TABLES or self._table not in ("", table) or not has_joints(list(columns)):
            return
        self._table = table
        if self._stream is None:
            self._stream = self._make()
        self._stream.feed(time, columns)

    def flush(self) -> None:
        """Write what waits."""
        if self._stream is not None:
            self._stream.flush()


def problem_of(body: bytes) -> str | None:
    """What is wrong with a message, read field by field; None for a sound one."""
    at = 4

    def align(size: int) -> None:
        nonlocal at
        at += -(at - 4) % size

    def number() -> int:
        nonlocal at
        align(4)
        (value,) = struct.unpack_from("<I", body, at)
        at += 4
        return int(value)

    def text() -> None:
        nonlocal at
        length = number()
        data = body[at : at + length]
        if len(data) < length or not data.endswith(b"\0"):
            raise ValueError("a text has no end")
        data.decode()
        at += length

    try:
        if body[:4] != b"\x00\x01\x00\x00":
            return "it is not little-endian CDR"
        number()
        if number() >= 1_000_000_000:
            return "its stamp has more than a second of nanoseconds"
        text()
        joints = number()
        for _ in range(joints):
            text()
        for field in ("position", "velocity", "effort"):
            count = number()
            if count not in (0, joints):
                return f"it has {count} numbers of {field} for {joints} joints"
            if count:
                align(8)
                at += 8 * count
        return None if at == len(body) else f"it is {len(body)} bytes long, its fields say {at}"
    except (struct.error, ValueError) as error:
        return str(error)
