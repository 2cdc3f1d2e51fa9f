"""What is in a log, from its summary and first records, without reading the messages."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mcap import records
from mcap.opcode import Opcode

from hdsim.errors import InputError
from hdsim.log import naming, scan
from hdsim.log.facts import RECORD, Facts
from hdsim.log.naming import ColumnSpec
from hdsim.log.schemas import message_class


@dataclass
class LogInfo:
    """Result of `info_log`.

    Args:
        path: the file.
        size: bytes.
        library: who wrote it.
        start_ns: first log time, ns since 1970; 0 without messages.
        end_ns: last log time.
        messages: message counts by topic.
        message_types: type by topic.
        tables: columns by table; ``static`` holds the static arrays.
        metadata: by record name.
        attachments: sizes in bytes by name.
        chunks: number of chunks.
        fields: fields of the messages, by topic, of every topic that has messages.
    """

    path: Path
    size: int
    library: str = ""
    start_ns: int = 0
    end_ns: int = 0
    messages: dict[str, int] = field(default_factory=dict)
    message_types: dict[str, str] = field(default_factory=dict)
    tables: dict[str, list[ColumnSpec]] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, int] = field(default_factory=dict)
    chunks: int = 0
    fields: dict[str, list[str]] = field(default_factory=dict)

    @property
    def drive_radius(self) -> float:
        """Pitch radius of the drive in m, as the scene says; 0.025 without one."""
        return float(self.metadata.get("hdsim.scene", {}).get("pitch_radius_m", "0.025"))

    @property
    def facts(self) -> Facts:
        """What layouts have to know of the run; what is not in the log has its default."""
        return Facts.read(self.metadata.get(RECORD, {}))

    @property
    def duration(self) -> float:
        """Time from the first to the last message, in s."""
        return (self.end_ns - self.start_ns) / 1e9

    @property
    def start(self) -> float:
        """Time of the first message in s of the run."""
        return (self.start_ns - naming.EPOCH_NS) / 1e9 if self.start_ns else 0.0


def info_log(path: str | Path) -> LogInfo:
    """Read what a log says about itself.

    Raises:
        InputError: there is no such file, it is not MCAP, or it is damaged where this has to read.
    """
    data = scan.map_file(path)
    info = LogInfo(Path(path), len(data))
    statistics: records.Statistics | None = None
    schemas: dict[int, records.Schema] = {}
    channels: dict[int, records.Channel] = {}
    try:
        for span in scan.walk(data):
            match span.opcode:
                case Opcode.HEADER:
                    info.library = scan.parse(records.Header, data, span).library
                case Opcode.METADATA:
                    record = scan.parse(records.Metadata, data, span)
                    info.metadata[record.name] = record.metadata
                    if record.name.startswith(naming.TABLE_RECORD):
                        name = record.name.removeprefix(naming.TABLE_RECORD)
                        info.tables[name] = naming.columns_from_json(record.metadata.get("columns", ""))
                case Opcode.ATTACHMENT:
                    attachment = scan.parse(records.Attachment, data, span)
                    info.attachments[attachment.name] = len(attachment.data)
                case Opcode.SCHEMA:
                    schema = scan.parse(records.Schema, data, span)
                    schemas[schema.id] = schema
                case Opcode.CHANNEL:
                    channel = scan.parse(records.Channel, data, span)
                    channels[channel.id] = channel
                case Opcode.STATISTICS:
                    statistics = scan.parse(records.Statistics, data, span)
                case Opcode.FOOTER:
                    scan.check_summary(data, span)
    except scan.TruncatedError as error:
        raise InputError(f"{path} is truncated: {error}; try `hdsim recover {path}`") from None
    except scan.DamageError as error:
        raise InputError(f"{path} is damaged: {error}; try `hdsim recover {path}`") from None
    if statistics is None:
        raise InputError(f"{path} has no statistics; try `hdsim recover {path}`")
    info.chunks = statistics.chunk_count
    info.start_ns, info.end_ns = statistics.message_start_time, statistics.message_end_time
    for id, channel in channels.items():
        info.messages[channel.topic] = statistics.channel_message_counts.get(id, 0)
        schema_or_none = schemas.get(channel.schema_id)
        info.message_types[channel.topic] = schema_or_none.name if schema_or_none else ""
        if info.messages[channel.topic]:
            info.fields[channel.topic] = _fields(schema_or_none)
    return info


def _fields(schema: records.Schema | None) -> list[str]:
    if schema is None or schema.encoding != "protobuf":
        return []
    try:
        return [f.name for f in message_class(schema.name, schema.data).DESCRIPTOR.fields]
    except ValueError:
        return []
