"""Walking through an MCAP file: records with their places, chunks with their CRCs, runs of equal messages."""

from __future__ import annotations

import mmap
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from itertools import groupby
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.container import MAGIC
from hdsim.log.rows import HEAD, SHARED_HEAD

Buffer = memoryview

_RECORD_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
_LARGEST_CHUNK = 1 << 32
_FEW = 16


class DamageError(Exception):
    """Bytes that are no MCAP; the message says what and where."""


class TruncatedError(DamageError):
    """The file ends before it should."""


@dataclass(frozen=True)
class Span:
    """A record's opcode and place: ``start`` of its opcode, ``body`` of what follows its length, ``end``."""

    opcode: int
    start: int
    end: int

    @property
    def body(self) -> slice:
        """Where the record's fields are."""
        return slice(self.start + _RECORD_HEAD.size, self.end)


def map_file(path: str | Path) -> Buffer:
    """The bytes of a file, not read until used.

    Raises:
        InputError: there is no such file, it is a folder, is empty, or is not MCAP.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path} is a folder; a log is a file, such as run.mcap")
    try:
        with open(path, "rb") as file:
            size = file.seek(0, 2)
            data = (
                memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)) if size else memoryview(b"")
            )
    except FileNotFoundError:
        partial = path.with_name(path.name + ".partial")
        hint = (
            f"; a run that was killed left {partial}, try `hdsim recover {partial}`"
            if partial.exists()
            else ""
        )
        raise InputError(f"{path}: there is no such file{hint}") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    if bytes(data[: len(MAGIC)]) != MAGIC:
        found = "an empty file" if not len(data) else f"a file that begins with {bytes(data[:8])!r}"
        raise InputError(f"{path} is not an MCAP log: found {found}")
    return data


def walk(data: Buffer, start: int = len(MAGIC)) -> Iterator[Span]:
    """Records outside of chunks, from ``start`` to the footer.

    Raises:
        TruncatedError: the file ends first, or a record's length is more than what is left.
        DamageError: there is no record where one should be, or the file does not end after the footer.
    """
    at = start
    while True:
        if at + _RECORD_HEAD.size > len(data):
            raise TruncatedError(f"the file ends at byte {len(data)}, before its footer")
        opcode, length = _RECORD_HEAD.unpack_from(data, at)
        end = at + _RECORD_HEAD.size + length
        if opcode == 0:
            raise DamageError(f"no record at byte {at}: opcode 0")
        if end > len(data):
            raise TruncatedError(f"the record at byte {at} needs {end - len(data)} bytes more than there are")
        yield Span(opcode, at, end)
        at = end
        if opcode == Opcode.FOOTER:
            if bytes(data[at:]) != MAGIC:
                raise TruncatedError(
                    f"the file does not end with the MCAP mark after its footer at byte {at}"
                )
            return


T_co = TypeVar("T_co", covariant=True)


class _RecordType(Protocol[T_co]):
    @staticmethod
    def read(stream: ReadDataStream, /) -> T_co: ...


def parse(kind: _RecordType[T_co], data: Buffer | bytes, span: Span) -> T_co:
    """A record of the ``mcap`` package from its place.

    Raises:
        DamageError: the bytes are no such record.
    """
    try:
        return kind.read(ReadDataStream(BytesIO(bytes(data[span.body]))))
    except (McapError, struct.error, UnicodeDecodeError, MemoryError, OverflowError) as error:
        raise DamageError(f"the record at byte {span.start} is damaged: {error!r}") from None


def check_attachment(data: Buffer, span: Span) -> None:
    """Raise `DamageError` unless an attachment's CRC is right."""
    stated = int.from_bytes(data[span.end - 4 : span.end], "little")
    actual = zlib.crc32(data[span.body][:-4])
    if stated not in (0, actual):
        raise DamageError(
            f"the attachment at byte {span.start} fails its CRC: {actual:#x}, should be {stated:#x}"
        )


@dataclass(frozen=True)
class OpenChunk:
    """A chunk's head, its bytes as stored, and its records."""

    start_time: int
    end_time: int
    compression: str
    packed: Buffer
    data: bytes


def open_chunk(data: Buffer, span: Span) -> OpenChunk:
    """Decompress a chunk and check its CRC.

    Raises:
        DamageError: it cannot be decompressed, or its size or CRC is not what it says.
    """
    where = f"the chunk at byte {span.start}"
    try:
        body = data[span.body]
        start, end, size, crc = _CHUNK_HEAD.unpack_from(body)
        at = _CHUNK_HEAD.size
        (length,) = struct.unpack_from("<I", body, at)
        compression = bytes(body[at + 4 : at + 4 + length]).decode()
        at += 4 + length
        (length,) = struct.unpack_from("<Q", body, at)
        packed = body[at + 8 :]
    except (struct.error, UnicodeDecodeError) as error:
        raise DamageError(f"{where} is damaged: {error}") from None
    if len(packed) != length or size > _LARGEST_CHUNK:
        raise DamageError(f"{where} is damaged: its lengths make no sense")
    try:
        content = _decompress(compression, packed, size)
    except (zstandard.ZstdError, MemoryError) as error:
        raise DamageError(f"{where} cannot be decompressed: {error}") from None
    if len(content) != size:
        raise DamageError(f"{where} holds {len(content)} bytes, should be {size}")
    actual = zlib.crc32(content)
    if crc not in (0, actual):
        raise DamageError(f"{where} fails its CRC: {actual:#x}, should be {crc:#x}")
    return OpenChunk(start, end, compression, packed, content)


def _decompress(compression: str, packed: Buffer, size: int) -> bytes:
    if compression == "":
        return bytes(packed)
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    if compression == "lz4":
        try:
            import lz4.frame  # type: ignore[import-not-found,import-untyped,unused-ignore]
        except ImportError:
            raise InputError("the log is compressed by lz4; install the package lz4 to read it") from None
        try:
            return bytes(lz4.frame.decompress(packed))
        except RuntimeError as error:
            raise zstandard.ZstdError(str(error)) from None
    raise InputError(f"the log is compressed by {compression!r}; allowed: zstd, lz4, none")


@dataclass(frozen=True)
class Run:
    """Records of a chunk that are alike: one of any kind, or messages of one channel and length, in order.

    Args:
        opcode: of all of them.
        start: where the first begins in ``data``; the others follow it at once.
        size: bytes of each.
        count: how many.
        data: the chunk, or a copy of those of its messages that are of this channel.
        places: where the messages are in the chunk, shape (count,); None if ``data`` is the chunk.
    """

    opcode: int
    start: int
    size: int
    count: int
    data: bytes
    places: NDArray[np.int64] | None = None

    @property
    def span(self) -> Span:
        """Place of the first."""
        return Span(self.opcode, self.start, self.start + self.size)

    @property
    def offsets(self) -> NDArray[np.int64]:
        """Where the records begin in the chunk, shape (count,)."""
        if self.places is not None:
            return self.places
        return self.start + self.size * np.arange(self.count, dtype=np.int64)


def runs(data: bytes, wanted: Callable[[int], bool] = lambda channel: True) -> Iterator[Run]:
    """The records of a chunk: first those that are no messages, then the messages channel by channel.

    Args:
        data: the chunk.
        wanted: whether messages of a channel are; asked when all else has been handed out.

    Raises:
        DamageError: a record leaves the chunk.
    """
    pieces: dict[bytes, list[tuple[int, int, int]]] = {}
    at = 0
    while at < len(data):
        if at + _RECORD_HEAD.size > len(data):
            raise DamageError(f"a chunk ends within a record, at byte {at}")
        opcode, length = _RECORD_HEAD.unpack_from(data, at)
        size = _RECORD_HEAD.size + length
        if at + size > len(data):
            raise DamageError(f"a record leaves its chunk, at byte {at}")
        if opcode != Opcode.MESSAGE:
            yield Run(opcode, at, size, 1, data)
            at += size
            continue
        if size < HEAD.size:
            raise DamageError(f"a message is too short, at byte {at}")
        count = _equal_heads(data, at, size)
        pieces.setdefault(data[at + _RECORD_HEAD.size : at + SHARED_HEAD], []).append((at, size, count))
        at += size * count
    for channel, of_channel in pieces.items():
        if wanted(int.from_bytes(channel, "little")):
            yield from _gather(data, of_channel)


def _gather(data: bytes, pieces: list[tuple[int, int, int]]) -> Iterator[Run]:
    """Messages of one channel, wherever they lie (start, size, count), one after the other."""
    if len(pieces) == 1:
        yield Run(Opcode.MESSAGE, *pieces[0], data)
        return
    gathered = b"".join([data[at : at + size * count] for at, size, count in pieces])
    begin = 0
    for size, alike in groupby(pieces, key=lambda piece: piece[1]):
        starts, counts = np.array([(at, count) for at, _, count in alike], np.int64).T
        total = int(counts.sum())
        within = np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
        places = np.repeat(starts, counts) + size * within
        yield Run(Opcode.MESSAGE, begin, size, total, gathered, places)
        begin += size * total


def _equal_heads(data: bytes, at: int, size: int) -> int:
    head = data[at : at + SHARED_HEAD]
    count, look = 1, _FEW
    # A few one by one: where topics share a chunk, most runs are short.
    while count < _FEW:
        if not data.startswith(head, at + count * size) or at + (count + 1) * size > len(data):
            return count
        count += 1
    while (left := (len(data) - at) // size - count) > 0:
        if data[at + count * size : at + count * size + SHARED_HEAD] != head:
            break
        # Look further each time: long runs in few steps, short ones without reading the whole chunk.
        look = min(left, 2 * look)
        block = np.frombuffer(data, np.uint8, look * size, at + count * size).reshape(look, size)
        same = (block[:, :SHARED_HEAD] == np.frombuffer(head, np.uint8)).all(axis=1)
        if not same.all():
            return count + int(np.argmin(same))
        count += look
    return count


def message_heads(run: Run) -> np.ndarray[Any, np.dtype[Any]]:
    """Heads of a run of messages: structured array (count,) of channel, sequence, log and publish time."""
    dtype = np.dtype(
        [
            ("opcode", "u1"),
            ("length", "<u8"),
            ("channel", "<u2"),
            ("sequence", "<u4"),
            ("log_time", "<u8"),
            ("publish_time", "<u8"),
            ("body", f"V{run.size - HEAD.size}"),
        ]
    )
    return np.frombuffer(run.data, dtype, run.count, run.start)


def message_bodies(run: Run) -> Iterator[bytes]:
    """Payloads of a run of messages."""
    for start in range(run.start, run.start + run.size * run.count, run.size):
        yield run.data[start + HEAD.size : start + run.size]


def data_crc(data: Buffer, end: int) -> int:
    """CRC of the data section: of all bytes before the DataEnd record."""
    return zlib.crc32(data[:end])


def check_data_end(data: Buffer, span: Span) -> None:
    """Raise `DamageError` unless the CRC of the data section is right or not given."""
    stated = parse(records.DataEnd, data, span).data_section_crc
    if stated and data_crc(data, span.start) != stated:
        raise DamageError(f"the data before byte {span.start} fails its CRC")


def check_summary(data: Buffer, footer: Span) -> None:
    """Raise `DamageError` unless the CRC of the summary is right or not given."""
    record = parse(records.Footer, data, footer)
    start = record.summary_start or footer.start
    if record.summary_crc and zlib.crc32(data[start : footer.end - 4]) != record.summary_crc:
        raise DamageError(f"the summary at byte {start} fails its CRC")
