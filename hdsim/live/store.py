"""What has been computed so far, kept so that a viewer can go back to it; the log itself is never touched."""

from __future__ import annotations

import tempfile
import threading
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.log import naming

if TYPE_CHECKING:
    from mcap import records

_FULL_RATE = frozenset(naming.PREFIX + name for name in naming.VIEWED_TABLES)
"""Topics that have a decimated twin."""

MOST_AT_ONCE = 256
"""Messages of a full-rate topic in one delivery. The queue of a viewer holds four times as many, and what
does not fit in pushes other topics out of it."""

_HEAD = array("q").itemsize
"""Bytes of a time, and of the end of a body, in the file."""


@dataclass
class Topic:
    """One topic: how it is encoded, and where its messages are, by the blocks in which they came.

    In the file a block is the times of its messages, then where each body ends, then the bodies. In memory
    stay three numbers a block, however many messages it has.
    """

    schema: records.Schema
    channel: records.Channel
    count: int = 0
    first_times: array[int] = field(default_factory=lambda: array("q"))
    first_numbers: array[int] = field(default_factory=lambda: array("q"))
    places: array[int] = field(default_factory=lambda: array("q"))
    opened: tuple[int, array[int], array[int]] = (-1, array("q"), array("q"))
    """Number, times and ends of the block that was read last."""


class MessageStore:
    """Messages by topic and time, in a temporary file; one thread adds, another reads."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed by close()
        self._lock = threading.Lock()
        self._end = 0
        self.topics: dict[str, Topic] = {}

    def add(
        self,
        schema: records.Schema,
        channel: records.Channel,
        log_times: Sequence[int],
        bodies: Sequence[bytes],
    ) -> None:
        """Add a block of messages of a topic, in the order of time; this is what a log's writer calls."""
        if not bodies:
            return
        ends = array("q", accumulate(map(len, bodies)))
        block = b"".join([array("q", log_times).tobytes(), ends.tobytes(), *bodies])
        with self._lock:
            topic = self.topics.get(channel.topic)
            if topic is None:
                topic = self.topics[channel.topic] = Topic(schema, channel)
            topic.first_times.append(log_times[0])
            topic.first_numbers.append(topic.count)
            topic.places.append(self._end)
            topic.count += len(bodies)
            self._file.seek(self._end)
            self._file.write(block)
            self._end += len(block)

    def following(
        self, seen: dict[str, int], end: int, wanted: Callable[[str], bool] = lambda topic: True
    ) -> list[tuple[int, str, bytes]]:
        """Messages that have not been seen, up to the time ``end`` (ns): time, topic, body, in that order.

        Of a full-rate topic at most `MOST_AT_ONCE`, evenly spread, the last one among them.

        Args:
            seen: number of messages seen of each topic; brought up to date. By number, not by time, because
                an event may be told when its time has passed.
            end: ns.
            wanted: whether anybody wants a topic; others count as seen.
        """
        found = []
        with self._lock:
            for name, topic in self.topics.items():
                first, last = seen.get(name, 0), self._until(topic, end)
                seen[name] = last
                if last > first and wanted(name):
                    step = -(-(last - first) // MOST_AT_ONCE) if name in _FULL_RATE else 1
                    numbers = range(first + (last - 1 - first) % step, last, step)
                    found += [(at, name, body) for at, body in self._read(topic, numbers)]
        return sorted(found, key=lambda message: message[0])

    def rewind(self, seen: dict[str, int], at: int) -> None:
        """Count as seen what is not later than ``at`` (ns), and nothing else."""
        with self._lock:
            seen.update({name: self._until(topic, at) for name, topic in self.topics.items()})

    def latest(self, at: int) -> list[tuple[int, str, bytes]]:
        """The last message of each topic at a time (ns): what a viewer shows after a seek."""
        found = []
        with self._lock:
            for name, topic in self.topics.items():
                last = self._until(topic, at)
                numbers = range(last - 1, last) if last else range(0)
                found += [(time, name, body) for time, body in self._read(topic, numbers)]
        return sorted(found, key=lambda message: message[0])

    def _until(self, topic: Topic, at: int) -> int:
        """Number of messages that are not later than ``at``."""
        block = bisect_right(topic.first_times, at) - 1
        if block < 0:
            return 0
        return topic.first_numbers[block] + bisect_right(self._open(topic, block)[0], at)

    def _open(self, topic: Topic, block: int) -> tuple[array[int], array[int]]:
        """Times and ends of a block's messages."""
        if topic.opened[0] != block:
            following = topic.first_numbers[block + 1 : block + 2]
            count = (following[0] if following else topic.count) - topic.first_numbers[block]
            self._file.seek(topic.places[block])
            data = self._file.read(2 * count * _HEAD)
            topic.opened = block, array("q", data[: len(data) // 2]), array("q", data[len(data) // 2 :])
        return topic.opened[1:]

    def _read(self, topic: Topic, numbers: range) -> list[tuple[int, bytes]]:
        """Time and body of messages."""
        found = []
        for number in numbers:
            block = bisect_right(topic.first_numbers, number) - 1
            times, ends = self._open(topic, block)
            k = number - topic.first_numbers[block]
            begin = ends[k - 1] if k else 0
            self._file.seek(topic.places[block] + 2 * len(times) * _HEAD + begin)
            found.append((times[k], self._file.read(ends[k] - begin)))
        return found

    def close(self) -> None:
        """Throw everything away."""
        with self._lock:
            self._file.close()
            self.topics.clear()


def read_log(path: str | Path, store: MessageStore) -> tuple[int, int]:
    """Put a finished log into a store; every CRC is checked.

    Returns:
        First and last log time, ns.

    Raises:
        InputError: the file is not MCAP, damaged, or holds no message.
    """
    from mcap import records
    from mcap.opcode import Opcode

    from hdsim.errors import InputError
    from hdsim.log import scan

    data = scan.map_file(path)
    schemas: dict[int, records.Schema] = {0: records.Schema(id=0, name="", encoding="", data=b"")}
    channels: dict[int, records.Channel] = {}
    ends: list[int] = []

    def register(content: bytes | scan.Buffer, span: scan.Span) -> None:
        if span.opcode == Opcode.SCHEMA:
            schema = scan.parse(records.Schema, content, span)
            schemas[schema.id] = schema
        else:
            channel = scan.parse(records.Channel, content, span)
            channels[channel.id] = channel

    def chunks() -> Iterator[bytes]:
        for span in scan.walk(data):
            if span.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                register(data, span)
            elif span.opcode == Opcode.CHUNK:
                yield scan.open_chunk(data, span).data

    try:
        for content in chunks():
            for run in scan.runs(content):
                if run.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    register(run.data, run.span)
                elif run.opcode == Opcode.MESSAGE:
                    heads = scan.message_heads(run)
                    channel = channels[int(heads["channel"][0])]
                    times = [int(t) for t in heads["log_time"]]
                    ends += [times[0], times[-1]]
                    bodies = [bytes(body) for body in scan.message_bodies(run)]
                    store.add(schemas[channel.schema_id], channel, times, bodies)
    except (scan.DamageError, KeyError) as error:
        raise InputError(f"{path} is damaged: {error}; try `hdsim recover {path}`") from None
    if not ends:
        raise InputError(f"{path} holds no message")
    return min(ends), max(ends)
