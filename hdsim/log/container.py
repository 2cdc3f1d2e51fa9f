"""The MCAP container on its way out: records, chunks with their indexes, the summary, every CRC.

The record types are those of the ``mcap`` package. Its ``Writer`` takes one message at a time and keeps its
state private, so the chunks are put together here, from blocks of finished Message records
(specification: https://mcap.dev/spec).
"""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, Any, BinaryIO, Literal, Protocol

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from numpy.typing import NDArray

from hdsim.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
CHUNK_SIZE = 1 << 20
"""Bytes of messages in a chunk before compression; what other MCAP writers choose too."""

ORDERED_CHUNK_SIZE = 1 << 22
"""The same where all topics share the chunks: enough that each finds itself again in what comes before."""

ZSTD = zstandard.ZstdCompressionParameters.from_level(4, source_size=ORDERED_CHUNK_SIZE, min_match=4)
"""A row of doubles repeats its tags and the leading bytes of its numbers: short matches. Level 1, which finds
none below seven bytes, makes a log a third larger in a third of the time."""

_ZSTD_DRAFT = zstandard.ZstdCompressionParameters.from_level(1, source_size=CHUNK_SIZE)
_INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])


class _Record(Protocol):
    def write(self, stream: RecordBuilder, /) -> object: ...


def encode(record: _Record) -> bytes:
    """Bytes of one record."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def library() -> str:
    """Who wrote the file, for its header."""
    try:
        return f"hdsim {version('hdsim')}; mcap {version('mcap')}"
    except PackageNotFoundError:
        return "hdsim"


def opened(path: Path, partial: Path) -> BinaryIO:
    """The file ``partial`` of a log that will be at ``path``, to be written; folders are made.

    Raises:
        InputError: the file cannot be made.
    """
    try:
        if path.is_dir():
            raise InputError(f"{path} is a folder; a log needs a file name, such as run.mcap")
        path.parent.mkdir(parents=True, exist_ok=True)
        return partial.open("wb")
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from None


class MessageIndexes:
    """Times and offsets of the messages of one chunk, by channel."""

    def __init__(self) -> None:
        self.by_channel: dict[int, NDArray[Any]] = {}

    def add(self, channel: int, log_times: NDArray[Any], offsets: NDArray[Any]) -> None:
        """Add messages of a channel: times (n,) in ns and offsets (n,) of their records in the chunk."""
        entries = np.empty(len(log_times), _INDEX_ENTRY)
        entries["log_time"], entries["offset"] = log_times, offsets
        if channel in self.by_channel:
            entries = np.concatenate([self.by_channel[channel], entries])
        self.by_channel[channel] = entries


Watch = Callable[[records.Schema, records.Channel, list[int], list[bytes]], None]
"""Sees messages as they are written: schema, channel, log times (ns) and bodies."""


class Container:
    """An MCAP file being written to a binary stream.

    Schemas and channels are numbered when asked for, but counted and repeated in the summary only once a
    chunk brings them: a channel without messages is an error to strict readers.

    Attributes:
        watch: sees every message as soon as it is known, before its chunk is full.

    Args:
        stream: where to.
        compression: of the chunks.
        draft: compress in a hurry, because the file will be written again.
        profile: of the file's header (https://mcap.dev/spec/registry#profiles).
    """

    def __init__(
        self,
        stream: IO[bytes],
        compression: Literal["zstd", "none"] = "zstd",
        *,
        draft: bool = False,
        profile: str = "",
    ) -> None:
        self._stream = stream
        self.watch: Watch | None = None
        self._position = 0
        self._crc = 0
        self._compressor: zstandard.ZstdCompressor | None = None
        if compression == "zstd":
            parameters = _ZSTD_DRAFT if draft else ZSTD
            self._compressor = zstandard.ZstdCompressor(compression_params=parameters)
        self._schemas: dict[int, records.Schema] = {}
        self._channels: dict[int, records.Channel] = {}
        self._chunk_indexes: list[bytes] = []
        self._metadata_indexes: list[bytes] = []
        self._attachment_indexes: list[bytes] = []
        self._counts: dict[int, int] = defaultdict(int)
        self._start: int | None = None
        self._end = 0
        self._put(MAGIC)
        self._put(encode(records.Header(profile=profile, library=library())))

    def _put(self, data: bytes | bytearray | memoryview) -> int:
        at = self._position
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._position += len(data)
        return at

    @property
    def topics(self) -> list[str]:
        """Topics that have messages."""
        return [channel.topic for channel in self._channels.values()]

    @property
    def duration(self) -> float:
        """Time from the first message to the last, in s."""
        return 0.0 if self._start is None else (self._end - self._start) / 1e9

    def flush(self) -> None:
        """Hand everything written so far to the operating system."""
        self._stream.flush()

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        data = encode(records.Metadata(name=name, metadata=dict(values)))
        at = self._put(data)
        self._metadata_indexes.append(encode(records.MetadataIndex(offset=at, length=len(data), name=name)))

    def record(self, data: bytes) -> None:
        """Write a finished record as it is."""
        self._put(data)

    def attachment(self, name: str, media_type: str, content: bytes, time: int) -> None:
        """Write an attachment; ``time`` in ns stands for its creation."""
        record = records.Attachment(
            create_time=time, log_time=time, name=name, media_type=media_type, data=content
        )
        data = encode(record)
        at = self._put(data)
        index = records.AttachmentIndex(
            offset=at,
            length=len(data),
            create_time=time,
            log_time=time,
            data_size=len(content),
            name=name,
            media_type=media_type,
        )
        self._attachment_indexes.append(encode(index))

    def chunk(
        self,
        data: bytes | bytearray | memoryview,
        indexes: MessageIndexes,
        schemas: Sequence[records.Schema],
        channels: Sequence[records.Channel],
        *,
        compressed: tuple[str, bytes] | None = None,
    ) -> None:
        """Write a chunk, its message indexes, and note what the summary has to say of it.

        Args:
            data: the records of the chunk.
            indexes: where its messages are; at least one.
            schemas: schemas that it brings or uses.
            channels: channels that it brings or uses.
            compressed: compression and bytes, if they exist already.
        """
        if compressed is not None:
            compression, packed = compressed
        elif self._compressor is not None:
            compression, packed = "zstd", self._compressor.compress(data)
        else:
            compression, packed = "", bytes(data)
        times = [e["log_time"] for e in indexes.by_channel.values()]
        start, end = int(min(t.min() for t in times)), int(max(t.max() for t in times))
        chunk = records.Chunk(
            compression=compression,
            data=packed,
            message_start_time=start,
            message_end_time=end,
            uncompressed_crc=zlib.crc32(data),
            uncompressed_size=len(data),
        )
        at = self._put(encode(chunk))
        index_at = self._position
        offsets: dict[int, int] = {}
        for channel, entries in indexes.by_channel.items():
            head = RecordBuilder()
            head.write1(Opcode.MESSAGE_INDEX)
            head.write8(6 + entries.nbytes)
            head.write2(channel)
            head.write4(entries.nbytes)
            offsets[channel] = self._put(bytes(head.end()))  # type: ignore[no-untyped-call]
            self._put(entries.tobytes())
            self._counts[channel] += len(entries)
        index = records.ChunkIndex(
            chunk_start_offset=at,
            chunk_length=index_at - at,
            message_start_time=start,
            message_end_time=end,
            message_index_offsets=offsets,
            message_index_length=self._position - index_at,
            compression=compression,
            compressed_size=len(packed),
            uncompressed_size=len(data),
        )
        self._chunk_indexes.append(encode(index))
        self._schemas.update({s.id: s for s in schemas})
        self._channels.update({c.id: c for c in channels})
        self._start = start if self._start is None else min(start, self._start)
        self._end = max(end, self._end)

    def finish(self) -> None:
        """Write the end of the data, the summary with its offsets, and the footer."""
        self._put(encode(records.DataEnd(data_section_crc=self._crc)))
        statistics = records.Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunk_indexes),
            message_count=sum(self._counts.values()),
            message_start_time=self._start or 0,
            message_end_time=self._end,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )
        groups: list[tuple[Opcode, list[bytes]]] = [
            (Opcode.SCHEMA, [encode(s) for s in self._schemas.values()]),
            (Opcode.CHANNEL, [encode(c) for c in self._channels.values()]),
            (Opcode.STATISTICS, [encode(statistics)]),
            (Opcode.CHUNK_INDEX, self._chunk_indexes),
            (Opcode.ATTACHMENT_INDEX, self._attachment_indexes),
            (Opcode.METADATA_INDEX, self._metadata_indexes),
        ]
        summary_start = self._position
        summary = bytearray()
        group_offsets = bytearray()
        for opcode, group in groups:
            if not group:
                continue
            start = len(summary)
            summary += b"".join(group)
            offset = records.SummaryOffset(
                group_opcode=opcode, group_start=summary_start + start, group_length=len(summary) - start
            )
            group_offsets += encode(offset)
        offsets_start = summary_start + len(summary)
        summary += group_offsets
        footer = encode(
            records.Footer(summary_start=summary_start, summary_offset_start=offsets_start, summary_crc=0)
        )
        # The CRC covers the summary and the footer up to the CRC itself.
        crc = zlib.crc32(footer[:-4], zlib.crc32(summary))
        self._put(summary + footer[:-4] + crc.to_bytes(4, "little") + MAGIC)
