"""MCAP Message records whose body is proto3 doubles: every row has the same bytes at the same places.

A proto3 double is one tag and eight bytes, and packed doubles are a tag, a length and eight bytes each
(https://protobuf.dev/programming-guides/encoding/). With every field written, zeros too, all messages of a
type are alike but for their numbers, so numpy fills or reads thousands of whole records at a time.
The record itself is opcode, length, channel, sequence, log time, publish time, body
(https://mcap.dev/spec#message-op0x05).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

HEAD = struct.Struct("<BQHIQQ")
"""Opcode, length of what follows, channel, sequence, log time, publish time."""

SHARED_HEAD = 11
"""Bytes of the head that are the same in all messages of a channel with a constant layout."""

_FIXED64, _LENGTH_DELIMITED = 1, 2


def varint(value: int) -> bytes:
    """A protobuf varint."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def read_varint(data: bytes | memoryview, at: int) -> tuple[int, int]:
    """Value of the varint at ``at`` and where it ends; IndexError where the data ends first."""
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at


@dataclass(frozen=True)
class DoubleField:
    """A field of a message: its number, and whether it is packed doubles rather than one double."""

    number: int
    repeated: bool

    @property
    def tag(self) -> bytes:
        """Bytes in front of the field."""
        return varint(self.number << 3 | (_LENGTH_DELIMITED if self.repeated else _FIXED64))


class RowLayout:
    """Where the bytes of a message lie.

    Args:
        fields: all fields in the order of their bytes.
        sizes: number of doubles of each field.

    Attributes:
        dtype: structured type of a whole Message record: ``channel``, ``sequence``, ``log_time``,
            ``publish_time`` and ``f0``, ``f1``, ... for the fields.
        template: shape (record size,), uint8; a record with all that is constant in it but the channel.
        constant: positions in the body's part of the record that hold tags and lengths.
    """

    def __init__(self, fields: Sequence[DoubleField], sizes: Sequence[int]) -> None:
        body = bytearray()
        names = ["channel", "sequence", "log_time", "publish_time"]
        formats: list[str | tuple[str, tuple[int, ...]]] = ["<u2", "<u4", "<u8", "<u8"]
        offsets = [9, 11, 15, 23]
        constant: list[int] = []
        for index, (field, size) in enumerate(zip(fields, sizes, strict=True)):
            head = field.tag + (varint(8 * size) if field.repeated else b"")
            start = HEAD.size + len(body)
            constant.extend(range(start, start + len(head)))
            names.append(f"f{index}")
            formats.append(("<f8", (size,)) if field.repeated else "<f8")
            offsets.append(start + len(head))
            body += head + bytes(8 * size)
        record = HEAD.pack(Opcode.MESSAGE, HEAD.size - 9 + len(body), 0, 0, 0, 0) + body
        self.size = len(record)
        self.template: NDArray[np.uint8] = np.frombuffer(record, np.uint8)
        self.constant = np.array(constant, np.intp)
        self.dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.size})

    @classmethod
    def of_message(cls, fields: Sequence[DoubleField], body: bytes | memoryview) -> RowLayout | None:
        """Layout of a message that was read; None when it leaves fields out or orders them otherwise."""
        at = 0
        sizes: list[int] = []
        try:
            for field in fields:
                tag = field.tag
                if bytes(body[at : at + len(tag)]) != tag:
                    return None
                at += len(tag)
                length = 8
                if field.repeated:
                    length, at = read_varint(body, at)
                if length % 8:
                    return None
                sizes.append(length // 8)
                at += length
        except IndexError:
            return None
        return cls(fields, sizes) if at == len(body) else None

    def matches(self, records: NDArray[np.uint8]) -> bool:
        """Whether whole records, shape (m, record size), all have this layout."""
        return bool((records[:, self.constant] == self.template[self.constant]).all())
