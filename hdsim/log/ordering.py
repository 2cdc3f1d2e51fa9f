"""A log in the order of time: from chunks of one topic each, as they are written, to chunks of all topics.

Programs that read a file from its beginning get the messages in the order of their times only so, and checks
such as ``mcap doctor`` expect it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
from mcap import records
from mcap.opcode import Opcode
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log import scan
from hdsim.log.container import ORDERED_CHUNK_SIZE, Container, MessageIndexes, encode, opened

Integers = NDArray[np.int64]

_SMALLEST = 1 << 18
"""Bytes of messages in a chunk of a short log."""


class _Topic:
    """The messages of a channel, one chunk of them in memory."""

    def __init__(self, channel: records.Channel, chunks: list[scan.Span]) -> None:
        self.channel = channel
        self.chunks = chunks
        self.data = b""
        self.times: Integers = np.empty(0, np.int64)
        self.offsets: Integers = np.empty(0, np.int64)
        self.sizes: Integers = np.empty(0, np.int64)

    def load(self, file: scan.Buffer) -> None:
        """Read the next chunk if the one in memory is used up."""
        if len(self.times) or not self.chunks:
            return
        self.data = scan.open_chunk(file, self.chunks.pop(0)).data
        found = scan.runs(self.data, lambda id: id == self.channel.id)
        runs = [run for run in found if run.opcode == Opcode.MESSAGE]
        self.times = np.concatenate([scan.message_heads(run)["log_time"].astype(np.int64) for run in runs])
        self.offsets = np.concatenate([run.offsets for run in runs])
        self.sizes = np.concatenate([np.full(run.count, run.size, np.int64) for run in runs])

    def take(self, horizon: int) -> tuple[Integers, Integers, Integers]:
        """Times, offsets and sizes of the messages up to a time, which leave."""
        count = int(np.searchsorted(self.times, horizon, side="right"))
        parts = self.times, self.offsets, self.sizes
        self.times, self.offsets, self.sizes = (part[count:] for part in parts)
        times, offsets, sizes = (part[:count] for part in parts)
        return times, offsets, sizes


class _Chunks:
    """Chunks of all topics on their way into a container."""

    def __init__(self, container: Container, schemas: dict[int, records.Schema], largest: int) -> None:
        self._container = container
        self._schemas = schemas
        self._largest = largest
        self._pieces: list[bytes] = []
        self._parts: list[tuple[records.Channel, Integers, Integers]] = []
        self._size = 0

    def add(self, topics: Sequence[_Topic], horizon: int) -> None:
        """Add the messages of topics up to a time, in the order of time and, at one time, of topics."""
        taken = [topic.take(horizon) for topic in topics]
        times, offsets, sizes = (np.concatenate(parts) for parts in zip(*taken, strict=True))
        of = np.repeat(np.arange(len(topics)), [len(part[0]) for part in taken])
        order = np.argsort(times, kind="stable")
        times, offsets, sizes, of = times[order], offsets[order], sizes[order], of[order]
        while len(times):
            ends = np.cumsum(sizes)
            count = 1 + int(np.searchsorted(ends, self._largest - self._size, side="left"))
            now = slice(0, count)
            self._append(topics, times[now], offsets[now], sizes[now], of[now])
            times, offsets, sizes, of = times[count:], offsets[count:], sizes[count:], of[count:]
            if self._size >= self._largest:
                self.flush()

    def _append(
        self, topics: Sequence[_Topic], times: Integers, offsets: Integers, sizes: Integers, of: Integers
    ) -> None:
        # Messages that lie side by side already stay together.
        apart = (np.diff(of) != 0) | (offsets[1:] != offsets[:-1] + sizes[:-1])
        firsts = np.concatenate([[0], np.flatnonzero(apart) + 1])
        lasts = np.append(firsts[1:], len(of)) - 1
        begins, ends = offsets[firsts].tolist(), (offsets[lasts] + sizes[lasts]).tolist()
        data = [topic.data for topic in topics]
        self._pieces += [
            data[k][begin:end] for k, begin, end in zip(of[firsts].tolist(), begins, ends, strict=True)
        ]
        places = self._size + np.cumsum(sizes) - sizes
        for k in np.unique(of).tolist():
            self._parts.append((topics[k].channel, times[of == k], places[of == k]))
        self._size += int(sizes.sum())

    def flush(self) -> None:
        """Write the chunk; it introduces the channels of its messages, so that it can be read alone."""
        if not self._parts:
            return
        channels = {channel.id: channel for channel, _, _ in self._parts}
        schemas = {c.schema_id: self._schemas[c.schema_id] for c in channels.values() if c.schema_id}
        head = b"".join(encode(record) for record in (*schemas.values(), *channels.values()))
        indexes = MessageIndexes()
        for channel, times, places in self._parts:
            indexes.add(channel.id, times, places + len(head))
        data = b"".join([head, *self._pieces])
        self._container.chunk(data, indexes, list(schemas.values()), list(channels.values()))
        self._pieces, self._parts, self._size = [], [], 0


def order_log(draft: Path, path: Path, compression: Literal["zstd", "none"]) -> None:
    """Write a finished log once more, its messages in the order of their times, and remove the draft.

    Args:
        draft: a log whose chunks hold one topic each, in the order of time.
        path: where the log will be; an existing one is replaced.
        compression: of the chunks.

    Raises:
        InputError: there is no room for it; the draft stays.
    """
    ordered = path.with_name(path.name + ".ordered")
    try:
        with opened(path, ordered) as out:
            _write_ordered(draft, out, compression)
        os.replace(ordered, path)
    except OSError as error:
        hint = f"{draft} holds everything, try `hdsim recover {draft}`"
        raise InputError(f"{path} cannot be written: {error.strerror}; {hint}") from None
    finally:
        ordered.unlink(missing_ok=True)
    draft.unlink()


def _write_ordered(path: Path, out: BinaryIO, compression: Literal["zstd", "none"]) -> None:
    file = scan.map_file(path)
    container = Container(out, compression)
    found = _survey(file)
    # First, so that a file that is cut short has them.
    for span in found.others:
        _copy(file, span, container)
    # Damage costs a chunk, so a short log has several.
    chunks = _Chunks(container, found.schemas, min(ORDERED_CHUNK_SIZE, max(_SMALLEST, found.size // 8)))
    left = found.topics
    while left:
        for topic in left:
            topic.load(file)
        left = [topic for topic in left if len(topic.times)]
        # What comes later in a topic with more chunks may lie between what the others have.
        horizon = min((int(t.times[-1]) for t in left if t.chunks), default=np.iinfo(np.int64).max)
        if left:
            chunks.add(left, horizon)
    chunks.flush()
    container.finish()


@dataclass
class _Found:
    """What a log holds: metadata and attachments, schemas, topics, bytes of all chunks."""

    others: list[scan.Span] = field(default_factory=list)
    schemas: dict[int, records.Schema] = field(default_factory=dict)
    topics: list[_Topic] = field(default_factory=list)
    size: int = 0


def _survey(file: scan.Buffer) -> _Found:
    found = _Found()
    channels: dict[int, records.Channel] = {}
    chunks: dict[int, list[scan.Span]] = {}
    last: scan.Span | None = None
    for span in scan.walk(file):
        match span.opcode:
            case Opcode.METADATA | Opcode.ATTACHMENT:
                found.others.append(span)
            case Opcode.CHUNK:
                last = span
            case Opcode.MESSAGE_INDEX:
                assert last is not None
                channel_id = int.from_bytes(file[span.body][:2], "little")
                chunks.setdefault(channel_id, []).append(last)
            case Opcode.SCHEMA:
                schema = scan.parse(records.Schema, file, span)
                found.schemas[schema.id] = schema
            case Opcode.CHANNEL:
                channel = scan.parse(records.Channel, file, span)
                channels[channel.id] = channel
            case Opcode.CHUNK_INDEX:
                found.size += scan.parse(records.ChunkIndex, file, span).uncompressed_size
    found.topics = [_Topic(channels[id], chunks[id]) for id in sorted(chunks)]
    return found


def _copy(file: scan.Buffer, span: scan.Span, container: Container) -> None:
    if span.opcode == Opcode.METADATA:
        record = scan.parse(records.Metadata, file, span)
        container.metadata(record.name, record.metadata)
    else:
        attachment = scan.parse(records.Attachment, file, span)
        container.attachment(attachment.name, attachment.media_type, attachment.data, attachment.log_time)
