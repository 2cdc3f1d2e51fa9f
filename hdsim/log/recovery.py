"""Saving what is whole in a log that is not: cut short by a crash, or with bytes changed."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from mcap import records
from mcap.opcode import Opcode

from hdsim.errors import InputError
from hdsim.log import naming, scan
from hdsim.log.container import MAGIC, Container, MessageIndexes, encode

# A zstd chunk can be found by the text of its compression field, 37 bytes behind its opcode.
_CHUNK_MARK = b"\x04\x00\x00\x00zstd"
_MARK_OFFSET = 37


@dataclass
class RecoverReport:
    """Result of `recover_log`.

    Args:
        path: the damaged file.
        out: the new one.
        chunks: whole chunks, all in the new file.
        messages: messages in them, by topic.
        lost: what was found damaged and left out, one line each.
    """

    path: Path
    out: Path
    chunks: int = 0
    messages: dict[str, int] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)


def recover_log(path: str | Path, out: str | Path) -> RecoverReport:
    """Write a sound log of everything that is whole in a damaged one.

    Args:
        path: a log, or the ``.partial`` of a run that was killed.
        out: where the new log goes; not the same file.

    Raises:
        InputError: the file is missing or no MCAP at all, holds nothing whole, or ``out`` cannot be written.
    """
    path, out = Path(path), Path(out)
    if out.exists() and path.exists() and out.samefile(path):
        raise InputError(f"{out} is the damaged log itself; name another file for the recovered one")
    data = scan.map_file(path)
    partial = out.with_name(out.name + ".partial")
    if partial.exists() and path.exists() and partial.samefile(path):
        partial = out.with_name(out.name + ".recovering")
    report = RecoverReport(path, out)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with open(partial, "wb") as file:
            rescue = _Rescue(report, Container(file), data)
            rescue.run()
    except OSError as error:
        raise InputError(f"{out} cannot be written: {error.strerror}") from None
    if not report.chunks and not rescue.metadata:
        partial.unlink()
        raise InputError(
            f"{path} holds nothing whole: {'; '.join(report.lost) or 'it ends after its header'}"
        )
    os.replace(partial, out)
    return report


class _Rescue:
    def __init__(self, report: RecoverReport, container: Container, data: scan.Buffer) -> None:
        self.report = report
        self.metadata = 0
        self._container = container
        self._data = data
        self._schemas: dict[int, records.Schema] = {}
        self._channels: dict[int, records.Channel] = {}

    def run(self) -> None:
        """Read from one end to the other, past everything that is damaged."""
        at: int | None = len(MAGIC)
        while at is not None:
            position, at = at, None
            try:
                for span in scan.walk(self._data, position):
                    position = span.start
                    if span.opcode == Opcode.DATA_END:
                        break
                    if span.opcode > Opcode.SUMMARY_OFFSET:
                        raise scan.DamageError(f"no record at byte {span.start}: opcode {span.opcode}")
                    try:
                        self._take(span)
                    except scan.DamageError as error:
                        self.report.lost.append(str(error))
                        # The damage may be in the record's length, and whole chunks lie within it.
                        swallowed = self._find_chunk(span.start + 1, span.end)
                        if swallowed is not None:
                            at = swallowed
                            break
                    position = span.end
            except scan.DamageError as error:
                self.report.lost.append(str(error))
                at = self._find_chunk(position + 1, len(self._data))
        text = "; ".join(self.report.lost)
        self._container.metadata(naming.RECOVERED_RECORD, {"from": self.report.path.name, "lost": text})
        self._container.finish()

    def _find_chunk(self, begin: int, end: int) -> int | None:
        """Start of the next thing that looks like a chunk."""
        window = 1 << 24
        find = begin + _MARK_OFFSET
        while find < end:
            found = bytes(self._data[find : find + window + len(_CHUNK_MARK)]).find(_CHUNK_MARK)
            if found < 0:
                find += window
                continue
            start = find + found - _MARK_OFFSET
            if start < end and self._data[start] == Opcode.CHUNK:
                return start
            find += found + 1
        return None

    def _take(self, span: scan.Span) -> None:
        data = self._data
        match span.opcode:
            case Opcode.SCHEMA | Opcode.CHANNEL:
                self._register(data, span)
            case Opcode.METADATA:
                record = scan.parse(records.Metadata, data, span)
                self._container.metadata(record.name, record.metadata)
                self.metadata += 1
            case Opcode.ATTACHMENT:
                scan.check_attachment(data, span)
                a = scan.parse(records.Attachment, data, span)
                self._container.attachment(a.name, a.media_type, a.data, a.log_time)
            case Opcode.CHUNK:
                self._take_chunk(span)
            case Opcode.MESSAGE:
                raise scan.DamageError(f"the message at byte {span.start} is outside of a chunk")

    def _register(self, data: scan.Buffer | bytes, span: scan.Span) -> int:
        if span.opcode == Opcode.SCHEMA:
            schema = scan.parse(records.Schema, data, span)
            return self._schemas.setdefault(schema.id, schema).id
        channel = scan.parse(records.Channel, data, span)
        return self._channels.setdefault(channel.id, channel).id

    def _take_chunk(self, span: scan.Span) -> None:
        chunk = scan.open_chunk(self._data, span)
        indexes = MessageIndexes()
        introduced: set[int] = set()
        counts: dict[str, int] = {}
        for run in scan.runs(chunk.data):
            if run.opcode == Opcode.SCHEMA:
                self._register(run.data, run.span)
            elif run.opcode == Opcode.CHANNEL:
                introduced.add(self._register(run.data, run.span))
            elif run.opcode == Opcode.MESSAGE:
                heads = scan.message_heads(run)
                id = int(heads["channel"][0])
                if id not in self._channels:
                    raise scan.DamageError(
                        f"the chunk at byte {span.start} needs channel {id}, lost with another"
                    )
                indexes.add(id, heads["log_time"], run.offsets)
                topic = self._channels[id].topic
                counts[topic] = counts.get(topic, 0) + run.count
        if not indexes.by_channel:
            return
        channels = [self._channels[id] for id in indexes.by_channel]
        schemas = [self._schemas[c.schema_id] for c in channels if c.schema_id in self._schemas]
        content, packed = chunk.data, (chunk.compression, bytes(chunk.packed))
        if not introduced.issuperset(indexes.by_channel):
            self._write_loose(schemas, channels)
        self._container.chunk(content, indexes, schemas, channels, compressed=packed)
        self.report.chunks += 1
        for topic, count in counts.items():
            self.report.messages[topic] = self.report.messages.get(topic, 0) + count

    def _write_loose(self, schemas: list[records.Schema], channels: list[records.Channel]) -> None:
        """Introduce channels whose own chunk may be among the lost ones."""
        for record in (*schemas, *channels):
            self._container.record(encode(record))
