"""Reading a log back into a recording, bit by bit."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap import records
from mcap.opcode import Opcode

from hdsim.errors import InputError
from hdsim.log import naming, scan, schemas
from hdsim.log.naming import Array, ColumnSpec
from hdsim.log.rows import HEAD, DoubleField, RowLayout
from hdsim.recording import Column, Event, Recording, Table

_EVENT_LEVELS = {0: "info", 1: "info", 2: "info", 3: "warning", 4: "error", 5: "error"}


def open_log(path: str | Path) -> Recording:
    """Read a log that hdsim wrote; every CRC in it is checked.

    Args:
        path: an MCAP file.

    Returns:
        Tables, static arrays, events and metadata as they were written; what was noted at the end of the
        run (statistics, ``incomplete``, ``recovered``) is in the metadata too.

    Raises:
        InputError: there is no such file, it is not MCAP, damaged, truncated, or not a log of hdsim.
    """
    data = scan.map_file(path)
    contents = _Contents()
    try:
        for span in scan.walk(data):
            contents.take(data, span)
    except scan.TruncatedError as error:
        raise InputError(f"{path} is truncated: {error}; try `hdsim recover {path}`") from None
    except scan.DamageError as error:
        raise InputError(f"{path} is damaged: {error}; try `hdsim recover {path}`") from None
    try:
        return contents.recording()
    except scan.DamageError as error:
        raise InputError(f"{path} cannot be read: {error}") from None


def read_attachments(path: str | Path) -> dict[str, bytes]:
    """Attachments of a log by name, such as ``scenario.yaml``; their CRCs are checked.

    Raises:
        InputError: as `open_log`.
    """
    data = scan.map_file(path)
    found: dict[str, bytes] = {}
    try:
        for span in scan.walk(data):
            if span.opcode == Opcode.ATTACHMENT:
                scan.check_attachment(data, span)
                record = scan.parse(records.Attachment, data, span)
                found[record.name] = record.data
    except scan.DamageError as error:
        raise InputError(f"{path} is damaged: {error}; try `hdsim recover {path}`") from None
    return found


def double_fields(schema: records.Schema) -> list[tuple[str, DoubleField]] | None:
    """Names and fields of a message type that is doubles only, in order; None for any other type."""
    descriptor: Any = schemas.message_class(schema.name, schema.data).DESCRIPTOR
    fields = sorted(descriptor.fields, key=lambda f: f.number)
    if any(f.type != f.TYPE_DOUBLE or (f.is_repeated and not f.is_packed) for f in fields):
        return None
    return [(f.name, DoubleField(f.number, bool(f.is_repeated))) for f in fields]


class TopicReader:
    """Collects the messages of a topic whose type is doubles only."""

    def __init__(self, channel: records.Channel, schema: records.Schema) -> None:
        fields = double_fields(schema)
        if fields is None:
            raise scan.DamageError(f"topic {channel.topic} holds {schema.name}, which is not of doubles only")
        self.channel = channel
        self.names = [name for name, _ in fields]
        self._fields = [field for _, field in fields]
        self._class: Any = schemas.message_class(schema.name, schema.data)
        self._layout: RowLayout | None = None
        self._blocks: list[list[Array]] = []

    def take(self, run: scan.Run) -> None:
        """Decode a run of messages: at once where the bytes are laid out as hdsim does, else singly."""
        layout = self._layout
        if layout is None or layout.size != run.size:
            body = memoryview(run.data)[run.start + HEAD.size : run.start + run.size]
            layout = RowLayout.of_message(self._fields, body)
        if layout is not None:
            whole = np.frombuffer(run.data, np.uint8, run.count * run.size, run.start)
            if layout.matches(whole.reshape(run.count, run.size)):
                self._layout = layout
                rows = np.frombuffer(run.data, layout.dtype, run.count, run.start)
                self._blocks.append([rows[f"f{i}"].astype(np.float64) for i in range(len(self.names))])
                return
        self._blocks.append(self._one_by_one(run))

    def _one_by_one(self, run: scan.Run) -> list[Array]:
        from google.protobuf.message import DecodeError

        values: list[list[Any]] = [[] for _ in self.names]
        try:
            for body in scan.message_bodies(run):
                message = self._class.FromString(body)
                for column, name, field in zip(values, self.names, self._fields, strict=True):
                    value = getattr(message, name)
                    column.append(list(value) if field.repeated else value)
            return [np.array(column, np.float64) for column in values]
        except (DecodeError, ValueError) as error:
            raise scan.DamageError(f"a message of {self.channel.topic} cannot be decoded: {error}") from None

    def columns(self) -> dict[str, Array]:
        """All rows by field name."""
        try:
            arrays = [np.concatenate(parts) for parts in zip(*self._blocks, strict=True)]
        except ValueError:
            raise scan.DamageError(f"arrays of topic {self.channel.topic} change their length") from None
        return dict(zip(self.names, arrays, strict=True))


class _Contents:
    """What has been read of a log."""

    def __init__(self) -> None:
        self._ours = False
        self._names: set[str] = set()
        self.metadata: dict[str, str] = {}
        self.tables: dict[str, tuple[str, list[ColumnSpec]]] = {}
        self.events: list[Event] = []
        self._schemas: dict[int, records.Schema] = {}
        self._topics: dict[int, TopicReader | None] = {}
        self._event_channels: dict[int, Any] = {}

    def take(self, data: scan.Buffer, span: scan.Span) -> None:
        match span.opcode:
            case Opcode.METADATA:
                self._take_metadata(scan.parse(records.Metadata, data, span))
            case Opcode.SCHEMA | Opcode.CHANNEL:
                self._register(data, span)
            case Opcode.CHUNK:
                for run in scan.runs(scan.open_chunk(data, span).data, self._reads):
                    self._take_run(run)
            case Opcode.MESSAGE:
                record = bytes(data[span.start : span.end])
                self._take_run(scan.Run(span.opcode, 0, len(record), 1, record))
            case Opcode.DATA_END:
                scan.check_data_end(data, span)
            case Opcode.FOOTER:
                scan.check_summary(data, span)

    def _take_metadata(self, record: records.Metadata) -> None:
        if record.name in (naming.RUN_RECORD, naming.STATISTICS_RECORD):
            self._ours = True
            self.metadata.update(record.metadata)
        elif record.name == naming.INCOMPLETE_RECORD:
            self.metadata["incomplete"] = record.metadata.get("reason", "")
        elif record.name == naming.RECOVERED_RECORD:
            self.metadata["recovered"] = record.metadata.get("lost", "")
        elif record.name.startswith(naming.TABLE_RECORD):
            name = record.name.removeprefix(naming.TABLE_RECORD)
            columns = naming.columns_from_json(record.metadata.get("columns", ""))
            self.tables[name] = (record.metadata.get("topic", ""), columns)

    def _register(self, data: scan.Buffer | bytes, span: scan.Span) -> None:
        if span.opcode == Opcode.SCHEMA:
            schema = scan.parse(records.Schema, data, span)
            self._schemas[schema.id] = schema
            return
        channel = scan.parse(records.Channel, data, span)
        self._names.add(channel.topic)
        if channel.id in self._topics or channel.id in self._event_channels:
            return
        schema_or_none = self._schemas.get(channel.schema_id)
        if schema_or_none is None or channel.message_encoding != "protobuf":
            self._topics[channel.id] = None
        elif channel.topic == naming.EVENT_TOPIC:
            self._event_channels[channel.id] = schemas.message_class(schema_or_none.name, schema_or_none.data)
        elif self._wanted(channel, schema_or_none):
            self._topics[channel.id] = TopicReader(channel, schema_or_none)
        else:
            self._topics[channel.id] = None

    def _wanted(self, channel: records.Channel, schema: records.Schema) -> bool:
        topics = {topic for topic, _ in self.tables.values()}
        if channel.topic in topics:
            return True
        # The record that describes the table may be lost; its channel says the same.
        name = channel.topic.removeprefix(naming.PREFIX)
        is_table = schema.name == naming.message_type_of(name) and "columns" in channel.metadata
        if is_table:
            self.tables[name] = (channel.topic, naming.columns_from_json(channel.metadata["columns"]))
        return is_table

    def _reads(self, channel: int) -> bool:
        return channel in self._event_channels or self._topics.get(channel) is not None

    def _take_run(self, run: scan.Run) -> None:
        if run.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            try:
                self._register(run.data, run.span)
            except ValueError as error:
                raise scan.DamageError(str(error)) from None
        elif run.opcode == Opcode.MESSAGE:
            channel = int(scan.message_heads(run)["channel"][0])
            if channel in self._event_channels:
                self._take_events(self._event_channels[channel], run)
            elif (topic := self._topics.get(channel)) is not None:
                topic.take(run)

    def _take_events(self, kind: Any, run: scan.Run) -> None:
        for body in scan.message_bodies(run):
            log = kind.FromString(body)
            stamp = log.timestamp.seconds * 1_000_000_000 + log.timestamp.nanos - naming.EPOCH_NS
            time = float(log.time) if hasattr(log, "time") else stamp / 1e9
            self.events.append(Event(time, _EVENT_LEVELS.get(log.level, "info"), log.name, log.message))

    def recording(self) -> Recording:
        if not self._ours and not self.tables:
            topics = ", ".join(sorted(self._names)) or "none"
            raise scan.DamageError(f"it is not a log of hdsim; its topics: {topics}")
        by_topic = {t.channel.topic: t.columns() for t in self._topics.values() if t is not None}
        recording = Recording({}, metadata=self.metadata, events=self.events)
        for name, (topic, specs) in self.tables.items():
            arrays = by_topic.get(topic, {})
            if name == "static":
                recording.static = dict(_static_columns(specs, arrays))
            else:
                recording.tables[name] = _table(specs, arrays)
        measured = self.metadata.get(naming.ORIGIN_KEY) == naming.MEASURED
        if measured and naming.MEASURED in recording.tables and "state" not in recording.tables:
            recording.tables["state"] = recording.tables.pop(naming.MEASURED)
        return recording


def _static_columns(specs: list[ColumnSpec], arrays: dict[str, Array]) -> Iterator[tuple[str, Column]]:
    for spec in specs:
        values = arrays.get(spec.field)
        if values is not None:
            yield spec.name, Column(values[0].reshape(spec.shape), spec.unit, spec.description)


def _table(specs: list[ColumnSpec], arrays: dict[str, Array]) -> Table:
    time = arrays.get("time", np.zeros(0))
    table = Table(time)
    for spec in specs:
        values = arrays.get(spec.field, np.zeros((0, *spec.shape)))
        table.columns[spec.name] = Column(values, spec.unit, spec.description)
    # Files that other programs wrote may hold chunks in any order.
    if len(time) > 1 and bool(np.any(np.diff(time) < 0)):
        order = np.argsort(time, kind="stable")
        table.time = time[order]
        table.columns = {n: Column(c.values[order], c.unit, c.description) for n, c in table.columns.items()}
    return table
