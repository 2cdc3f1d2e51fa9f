"""Verifying a log: everything a strict reader could stumble over, found here first."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mcap import records
from mcap.opcode import Opcode

from hdsim.log import naming, scan
from hdsim.log.message_check import MessageCheck

_MOST_PROBLEMS = 50

_SUMMARY_TYPES: dict[int, Any] = {
    Opcode.SCHEMA: records.Schema,
    Opcode.CHANNEL: records.Channel,
    Opcode.STATISTICS: records.Statistics,
    Opcode.CHUNK_INDEX: records.ChunkIndex,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
    Opcode.METADATA_INDEX: records.MetadataIndex,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset,
    Opcode.FOOTER: records.Footer,
}


@dataclass
class TopicCheck:
    """What was found of a topic: messages, type, encoding, first and last log time (ns)."""

    topic: str
    message_type: str
    encoding: str
    messages: int = 0
    first_ns: int | None = None
    last_ns: int | None = None


@dataclass
class VerifyReport:
    """Result of `verify_log`.

    Args:
        path: the file.
        problems: what is wrong, one line each; empty for a sound log.
        topics: by topic.
        chunks: number of chunks.
        attachments: names.
        metadata: names of records.
    """

    path: Path
    problems: list[str] = field(default_factory=list)
    topics: dict[str, TopicCheck] = field(default_factory=dict)
    chunks: int = 0
    attachments: list[str] = field(default_factory=list)
    metadata: list[str] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems

    @property
    def messages(self) -> int:
        """Number of messages."""
        return sum(t.messages for t in self.topics.values())


def verify_log(path: str | Path) -> VerifyReport:
    """Check a log from its first byte to its last.

    All records, chunks, attachments, the data section and the summary against their CRCs; every message
    against its schema; message indexes, chunk indexes, statistics and the other summary records against
    what is there; log times against their order; JSON against NaN; that no channel is empty and that
    metadata and attachments are there; that no part of the model gave back heat.

    Args:
        path: an MCAP file.

    Raises:
        InputError: there is no such file or it is not MCAP at all.
    """
    data = scan.map_file(path)
    check = _Check(VerifyReport(Path(path)), data)
    try:
        for span in scan.walk(data):
            try:
                check.take(span)
            except scan.DamageError as error:
                check.problem(str(error))
        check.compare_summary()
    except scan.DamageError as error:
        check.problem(str(error))
    check.conclude()
    return check.report


class _Check:
    def __init__(self, report: VerifyReport, data: scan.Buffer) -> None:
        self.report = report
        self._data = data
        self._schemas: dict[int, records.Schema] = {}
        self._channels: dict[int, records.Channel] = {}
        self._checks: dict[int, MessageCheck] = {}
        self._chunk_indexes: list[records.ChunkIndex] = []
        self._expected: dict[int, list[tuple[int, int]]] = {}
        self._counts: Counter[int] = Counter()
        self._attachment_indexes: list[records.AttachmentIndex] = []
        self._metadata_indexes: list[records.MetadataIndex] = []
        self._spans: list[scan.Span] = []
        self._data_end: int | None = None
        self._summary: dict[int, list[Any]] = {}
        self._untold = 0

    def problem(self, text: str) -> None:
        if len(self.report.problems) < _MOST_PROBLEMS:
            self.report.problems.append(text)
        else:
            self._untold += 1

    def take(self, span: scan.Span) -> None:
        data = self._data
        self._spans.append(span)
        if self._data_end is not None:
            self._take_summary(span)
            return
        if self._expected and span.opcode != Opcode.MESSAGE_INDEX:
            self._miss_indexes()
        match span.opcode:
            case Opcode.SCHEMA | Opcode.CHANNEL:
                self._register(data, span)
            case Opcode.CHUNK:
                self._take_chunk(span)
            case Opcode.MESSAGE_INDEX:
                self._take_message_index(span)
            case Opcode.METADATA:
                metadata = scan.parse(records.Metadata, data, span)
                self.report.metadata.append(metadata.name)
                if "energy_from_nothing" in metadata.metadata:
                    self.problem(f"energy from nothing: {metadata.metadata['energy_from_nothing']}")
                length = span.end - span.start
                self._metadata_indexes.append(
                    records.MetadataIndex(offset=span.start, length=length, name=metadata.name)
                )
            case Opcode.ATTACHMENT:
                self._take_attachment(span)
            case Opcode.MESSAGE:
                self.problem(f"the message at byte {span.start} is outside of a chunk, so it is not indexed")
            case Opcode.DATA_END:
                self._data_end = span.start
                scan.check_data_end(data, span)

    def _register(self, data: scan.Buffer | bytes, span: scan.Span) -> None:
        if span.opcode == Opcode.SCHEMA:
            schema = scan.parse(records.Schema, data, span)
            if self._schemas.setdefault(schema.id, schema) != schema:
                self.problem(f"schema {schema.id} is given twice and differs")
            return
        channel = scan.parse(records.Channel, data, span)
        known = self._channels.setdefault(channel.id, channel)
        if known is not channel:
            if known != channel:
                self.problem(f"channel {channel.id} ({channel.topic}) is given twice and differs")
            return
        schema_or_none = self._schemas.get(channel.schema_id)
        if channel.schema_id and schema_or_none is None:
            self.problem(
                f"channel {channel.id} ({channel.topic}) needs schema {channel.schema_id}, not there"
            )
        if any(c.topic == channel.topic and c.id != channel.id for c in self._channels.values()):
            self.problem(f"topic {channel.topic} has more than one channel")
        try:
            check = MessageCheck(channel, schema_or_none)
        except ValueError as error:
            self.problem(f"topic {channel.topic}: {error}")
            return
        if check.reason:
            self.problem(check.reason)
        self._checks[channel.id] = check

    def _take_attachment(self, span: scan.Span) -> None:
        scan.check_attachment(self._data, span)
        a = scan.parse(records.Attachment, self._data, span)
        self.report.attachments.append(a.name)
        self._attachment_indexes.append(
            records.AttachmentIndex(
                offset=span.start,
                length=span.end - span.start,
                create_time=a.create_time,
                log_time=a.log_time,
                data_size=len(a.data),
                name=a.name,
                media_type=a.media_type,
            )
        )

    def _take_chunk(self, span: scan.Span) -> None:
        self.report.chunks += 1
        chunk = scan.open_chunk(self._data, span)
        times: list[int] = []
        for run in scan.runs(chunk.data):
            if run.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._register(run.data, run.span)
            elif run.opcode == Opcode.MESSAGE:
                times += self._take_messages(run)
        if (chunk.start_time, chunk.end_time) != (min(times, default=0), max(times, default=0)):
            self.problem(f"the chunk at byte {span.start} states other times than its messages have")
        self._chunk_indexes.append(
            records.ChunkIndex(
                chunk_start_offset=span.start,
                chunk_length=span.end - span.start,
                message_start_time=chunk.start_time,
                message_end_time=chunk.end_time,
                message_index_offsets={},
                message_index_length=0,
                compression=chunk.compression,
                compressed_size=len(chunk.packed),
                uncompressed_size=len(chunk.data),
            )
        )

    def _take_messages(self, run: scan.Run) -> list[int]:
        heads = scan.message_heads(run)
        log_times = heads["log_time"].astype(np.int64)
        ends = [int(log_times.min()), int(log_times.max())]
        id = int(heads["channel"][0])
        self._expected.setdefault(id, []).extend(zip(log_times.tolist(), run.offsets.tolist(), strict=True))
        self._counts[id] += run.count
        channel = self._channels.get(id)
        if channel is None:
            self.problem(f"{run.count} messages of channel {id}, which was not introduced before them")
            return ends
        schema = self._schemas.get(channel.schema_id)
        topic = self.report.topics.setdefault(
            channel.topic,
            TopicCheck(channel.topic, schema.name if schema else "", channel.message_encoding),
        )
        before = topic.last_ns if topic.last_ns is not None else int(log_times[0])
        if bool((np.diff(log_times, prepend=before) < 0).any()):
            self.problem(f"topic {channel.topic}: log time goes back")
        if bool((heads["publish_time"] != heads["log_time"]).any()):
            self.problem(f"topic {channel.topic}: publish time differs from log time")
        topic.messages += run.count
        topic.first_ns = topic.first_ns if topic.first_ns is not None else int(log_times[0])
        topic.last_ns = int(log_times[-1])
        check = self._checks.get(id)
        wrong = check.take(run) if check else None
        if wrong:
            self.problem(f"topic {channel.topic}: {wrong}")
        return ends

    def _take_message_index(self, span: scan.Span) -> None:
        index = scan.parse(records.MessageIndex, self._data, span)
        if sorted(index.records) != sorted(self._expected.pop(index.channel_id, [])):
            self.problem(f"the message index at byte {span.start} disagrees with its chunk")
        if self._chunk_indexes:
            chunk = self._chunk_indexes[-1]
            chunk.message_index_offsets[index.channel_id] = span.start
            chunk.message_index_length += span.end - span.start

    def _miss_indexes(self) -> None:
        for id, entries in self._expected.items():
            if entries:
                self.problem(f"{len(entries)} messages of channel {id} are not indexed")
        self._expected = {}

    def _take_summary(self, span: scan.Span) -> None:
        kind = _SUMMARY_TYPES.get(span.opcode)
        if kind is None:
            self.problem(
                f"the record at byte {span.start}, opcode {span.opcode}, does not belong in a summary"
            )
            return
        self._summary.setdefault(span.opcode, []).append(scan.parse(kind, self._data, span))
        if span.opcode == Opcode.FOOTER:
            scan.check_summary(self._data, span)

    def compare_summary(self) -> None:
        """Hold the summary against what was read."""
        if self._data_end is None:
            self.problem("there is no DataEnd record")
        footer = self._summary.get(Opcode.FOOTER, [None])[0]
        if footer is None or not footer.summary_start:
            self.problem("there is no summary")
            return
        self._compare("schemas", {s.id: s for s in self._summary.get(Opcode.SCHEMA, [])}, self._schemas)
        self._compare("channels", {c.id: c for c in self._summary.get(Opcode.CHANNEL, [])}, self._channels)
        self._compare("chunk indexes", self._summary.get(Opcode.CHUNK_INDEX, []), self._chunk_indexes)
        self._compare(
            "attachment indexes", self._summary.get(Opcode.ATTACHMENT_INDEX, []), self._attachment_indexes
        )
        self._compare(
            "metadata indexes", self._summary.get(Opcode.METADATA_INDEX, []), self._metadata_indexes
        )
        starts = [c.message_start_time for c in self._chunk_indexes]
        ends = [c.message_end_time for c in self._chunk_indexes]
        statistics = records.Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunk_indexes),
            message_count=self._counts.total(),
            message_start_time=min(starts, default=0),
            message_end_time=max(ends, default=0),
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )
        self._compare("statistics", self._summary.get(Opcode.STATISTICS, []), [statistics])
        groups: dict[int, records.SummaryOffset] = {}
        for span in self._spans:
            if span.start < footer.summary_start or span.opcode in (Opcode.SUMMARY_OFFSET, Opcode.FOOTER):
                continue
            group = groups.setdefault(span.opcode, records.SummaryOffset(span.opcode, span.start, 0))
            group.group_length = span.end - group.group_start
        self._compare("summary offsets", self._summary.get(Opcode.SUMMARY_OFFSET, []), list(groups.values()))

    def _compare(self, what: str, stated: object, found: object) -> None:
        if stated != found:
            self.problem(f"the {what} of the summary disagree with the data")

    def conclude(self) -> None:
        """Note what only shows at the end."""
        for channel in self._channels.values():
            if not self._counts[channel.id]:
                self.problem(f"topic {channel.topic} has a channel but no message")
        if naming.RUN_RECORD not in self.report.metadata:
            self.problem(f"there is no metadata record {naming.RUN_RECORD}")
        if not self.report.attachments:
            self.problem("there is no attachment")
        if self._untold:
            self.report.problems.append(f"and {self._untold} more")
