"""What has been computed so far, kept so that a viewer can go back to it; the log itself is never touched."""

from __future__ import annotations

import tempfile
import threading
from array import array
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.log import naming

if TYPE_CHECKING:
    from mcap import records

_FULL_RATE = frozenset(naming.PREFIX + name for name in naming.VIEWED_TABLES)
"""Topics that have a decimated twin, which is what viewers get."""


@dataclass
class Topic:
    """One topic: how it is encoded, and where its messages are."""

    schema: records.Schema
    channel: records.Channel
    times: array[int] = field(default_factory=lambda: array("q"))
    places: array[int] = field(default_factory=lambda: array("q"))
    sizes: array[int] = field(default_factory=lambda: array("q"))


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
        """Add messages of a topic, in the order of time; this is what a log's writer calls."""
        if channel.topic in _FULL_RATE:
            return
        with self._lock:
            topic = self.topics.get(channel.topic)
            if topic is None:
                topic = self.topics[channel.topic] = Topic(schema, channel)
            self._file.seek(self._end)
            for at, body in zip(log_times, bodies, strict=True):
                self._file.write(body)
                topic.places.append(self._end)
                topic.sizes.append(len(body))
                topic.times.append(at)
                self._end += len(body)

    def following(self, seen: dict[str, int], end: int) -> list[tuple[int, str, bytes]]:
        """Messages that have not been seen, up to the time ``end`` (ns): time, topic, body, in that order.

        Args:
            seen: number of messages seen of each topic; brought up to date. By number, not by time, because
                an event may be told when its time has passed.
            end: ns.
        """
        found = []
        with self._lock:
            for name, topic in self.topics.items():
                last = bisect_right(topic.times, end)
                found += [
                    (topic.times[k], name, self._read(topic, k)) for k in range(seen.get(name, 0), last)
                ]
                seen[name] = last
        return sorted(found, key=lambda message: message[0])

    def rewind(self, seen: dict[str, int], at: int) -> None:
        """Count as seen what is not later than ``at`` (ns), and nothing else."""
        with self._lock:
            seen.update({name: bisect_right(topic.times, at) for name, topic in self.topics.items()})

    def latest(self, at: int) -> list[tuple[int, str, bytes]]:
        """The last message of each topic at a time (ns): what a viewer shows after a seek."""
        with self._lock:
            found = []
            for name, topic in self.topics.items():
                k = bisect_right(topic.times, at) - 1
                if k >= 0:
                    found.append((topic.times[k], name, self._read(topic, k)))
        return sorted(found, key=lambda message: message[0])

    def _read(self, topic: Topic, index: int) -> bytes:
        self._file.seek(topic.places[index])
        return self._file.read(topic.sizes[index])

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
                    register(content, run.span)
                elif run.opcode == Opcode.MESSAGE:
                    heads = scan.message_heads(content, run)
                    channel = channels[int(heads["channel"][0])]
                    times = [int(t) for t in heads["log_time"]]
                    ends += [times[0], times[-1]]
                    bodies = [bytes(body) for body in scan.message_bodies(content, run)]
                    store.add(schemas[channel.schema_id], channel, times, bodies)
    except (scan.DamageError, KeyError) as error:
        raise InputError(f"{path} is damaged: {error}; try `hdsim recover {path}`") from None
    if not ends:
        raise InputError(f"{path} holds no message")
    return min(ends), max(ends)
