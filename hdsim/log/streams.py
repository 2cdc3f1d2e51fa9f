"""One topic on its way into chunks: tables of constant layout by numpy, other messages one by one."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from mcap import records
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log import naming, schemas
from hdsim.log.container import CHUNK_SIZE, Container, MessageIndexes, encode
from hdsim.log.naming import Array, ColumnSpec
from hdsim.log.rows import HEAD, DoubleField, RowLayout

_ENCODING = "protobuf"


def double_field(number: int, value: float) -> bytes:
    """One protobuf field of type double."""
    return DoubleField(number, repeated=False).tag + struct.pack("<d", value)


class Stream:
    """What all topics share. Each chunk repeats schema and channel, so that it can be read alone."""

    def __init__(
        self,
        container: Container,
        channel: int,
        topic: str,
        schema: records.Schema,
        metadata: dict[str, str],
        *,
        encoding: str = _ENCODING,
    ) -> None:
        self._container = container
        self._schema = schema
        self._channel = records.Channel(
            id=channel, topic=topic, message_encoding=encoding, schema_id=schema.id, metadata=metadata
        )
        self._preamble = encode(schema) + encode(self._channel)
        self._sequence = 0

    def _tell(self, log_times: NDArray[Any], records: NDArray[np.uint8], head: int) -> None:
        """Hand the bodies of whole Message records, shape (n, record size), to whoever watches the log."""
        watch = self._container.watch
        if watch is not None:
            watch(self._schema, self._channel, log_times.tolist(), [r[head:].tobytes() for r in records])

    def _write(self, data: bytes | memoryview, log_times: NDArray[Any], offsets: NDArray[Any]) -> None:
        indexes = MessageIndexes()
        indexes.add(self._channel.id, log_times, offsets)
        self._container.chunk(data, indexes, [self._schema], [self._channel])


class TableStream(Stream):
    """Rows of doubles, laid out as whole Message records in a buffer of one chunk.

    Args:
        container: where finished chunks go.
        channel: channel id.
        topic: topic.
        schema_id: schema id.
        message_type: protobuf type.
        columns: fields of the message after ``time``.
        metadata: the channel's metadata.
        time: whether the message begins with the time in s.
    """

    def __init__(
        self,
        container: Container,
        channel: int,
        topic: str,
        schema_id: int,
        message_type: str,
        columns: Sequence[ColumnSpec],
        metadata: dict[str, str],
        *,
        time: bool = True,
    ) -> None:
        schema = records.Schema(
            id=schema_id,
            name=message_type,
            encoding=_ENCODING,
            data=schemas.table_schema(message_type, columns, time=time),
        )
        super().__init__(container, channel, topic, schema, metadata)
        self.columns = list(columns)
        self.last_time: float | None = None
        repeated = ([False] if time else []) + [c.repeated for c in columns]
        sizes = ([1] if time else []) + [c.size for c in columns]
        fields = [DoubleField(naming.field_number(i), r) for i, r in enumerate(repeated)]
        self._layout = RowLayout(fields, sizes)
        self._has_time = time
        self._capacity = max(1, CHUNK_SIZE // self._layout.size)
        self._filled = 0
        head = len(self._preamble)
        self._buffer = bytearray(head + self._capacity * self._layout.size)
        self._buffer[:head] = self._preamble
        whole = np.frombuffer(self._buffer, np.uint8, offset=head).reshape(self._capacity, -1)
        whole[:] = self._layout.template
        self._rows = np.frombuffer(self._buffer, self._layout.dtype, offset=head)
        self._rows["channel"] = channel
        self._offsets = head + self._layout.size * np.arange(self._capacity, dtype=np.int64)

    @property
    def room(self) -> int:
        """Rows that the chunk still takes."""
        return self._capacity - self._filled

    def check(self, name: str, time: Array, columns: Sequence[ColumnSpec], values: Sequence[Array]) -> None:
        """Refuse a block that doesn't continue the table."""
        if [(c.name, c.shape) for c in columns] != [(c.name, c.shape) for c in self.columns]:
            raise InputError(
                f"table {name!r} began with columns {_shapes(self.columns)}; "
                f"this block has {_shapes(columns)}"
            )
        if time.ndim != 1:
            raise InputError(f"table {name!r}: time has shape {time.shape}; allowed: (n,)")
        for column, rows in zip(columns, values, strict=True):
            if len(rows) != len(time):
                raise InputError(
                    f"table {name!r}: column {column.name!r} has {len(rows)} rows, time has {len(time)}"
                )
        if not len(time):
            return
        before = -np.inf if self.last_time is None else self.last_time
        late = np.flatnonzero(np.diff(time, prepend=before) <= 0)
        if len(late):
            previous = time[late[0] - 1] if late[0] else before
            found = f"{float(time[late[0]])!r} s follows {float(previous)!r} s"
            raise InputError(f"table {name!r}: time must increase; {found}")

    def append(
        self,
        time: Array | None,
        log_times: NDArray[Any],
        columns: Sequence[Array],
        *,
        shown: bool = True,
    ) -> bool:
        """Add at most ``room`` rows; returns whether that filled a chunk, which is then written.

        Args:
            time: (n,), in s; None where the message has no time.
            log_times: (n,), ns.
            columns: arrays (n,) or (n, k).
            shown: whether who watches the log sees them too.
        """
        n = len(log_times)
        rows = self._rows[self._filled : self._filled + n]
        self._fill(rows, time, log_times, columns)
        if time is not None and n:
            self.last_time = float(time[-1])
        if shown and self.watched:
            self._tell(log_times, rows.view(np.uint8).reshape(n, -1), HEAD.size)
        self._sequence += n
        self._filled += n
        if self.room:
            return False
        self.flush()
        return True

    @property
    def watched(self) -> bool:
        """Whether anybody watches the log."""
        return self._container.watch is not None

    def show(self, time: Array | None, log_times: NDArray[Any], columns: Sequence[Array]) -> None:
        """Hand rows to who watches the log, and to nobody else; arguments as for `append`."""
        n = len(log_times)
        records = np.tile(self._layout.template, (n, 1))
        self._fill(records.view(self._layout.dtype)[:, 0], time, log_times, columns)
        self._tell(log_times, records, HEAD.size)

    def _fill(
        self, rows: NDArray[Any], time: Array | None, log_times: NDArray[Any], columns: Sequence[Array]
    ) -> None:
        rows["sequence"] = np.arange(self._sequence, self._sequence + len(rows)) & 0xFFFFFFFF
        rows["log_time"] = log_times
        rows["publish_time"] = log_times
        for index, values in enumerate(columns if time is None else [time, *columns]):
            rows[f"f{index}"] = values

    def flush(self) -> None:
        """Write the rows that wait."""
        if not self._filled:
            return
        rows = self._rows[: self._filled]
        data = memoryview(self._buffer)[: len(self._preamble) + self._filled * self._layout.size]
        self._write(data, rows["log_time"], self._offsets[: self._filled])
        self._filled = 0


class MessageStream(Stream):
    """Protobuf messages of any type and length."""

    def __init__(
        self,
        container: Container,
        channel: int,
        topic: str,
        schema_id: int,
        message_type: str,
        schema: bytes,
    ) -> None:
        record = records.Schema(id=schema_id, name=message_type, encoding=_ENCODING, data=schema)
        super().__init__(container, channel, topic, record, {})
        self._data = bytearray(self._preamble)
        self._log_times: list[int] = []
        self._offsets: list[int] = []

    def append(self, log_time: int, payload: bytes) -> None:
        """Add a message; a full chunk is written."""
        self._log_times.append(log_time)
        self._offsets.append(len(self._data))
        self._data += HEAD.pack(
            5, HEAD.size - 9 + len(payload), self._channel.id, self._sequence & 0xFFFFFFFF, log_time, log_time
        )
        self._data += payload
        self._sequence += 1
        if self._container.watch is not None:
            self._container.watch(self._schema, self._channel, [log_time], [payload])
        if len(self._data) >= CHUNK_SIZE:
            self.flush()

    def flush(self) -> None:
        """Write the messages that wait."""
        if not self._offsets:
            return
        self._write(bytes(self._data), np.array(self._log_times), np.array(self._offsets))
        self._data = bytearray(self._preamble)
        self._log_times, self._offsets = [], []


def _shapes(columns: Sequence[ColumnSpec]) -> str:
    return ", ".join(f"{c.name} {('n', *c.shape)}".replace("'", "") for c in columns)
