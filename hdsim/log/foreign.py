"""Numbers out of recordings that others made: CSV, Parquet, MCAP (json, protobuf, cdr), ROS 2 bags."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.mapping import Mapping, Origin

Array = NDArray[np.float64]

_FORMATS = {
    ".csv": "csv",
    ".txt": "csv",
    ".tsv": "csv",
    ".parquet": "parquet",
    ".pq": "parquet",
    ".mcap": "mcap",
    ".db3": "ros2",
}
_ROS_HINT = "reading ROS 2 messages needs the package rosbags: pip install 'hdsim[ros]'"


@dataclass
class Samples:
    """Numbers of one topic, or of a whole table.

    Args:
        values: arrays (n,) by origin; NaN where the recording has nothing.
        stamps: times (n,) of the messages in ns since 1970, by kind of stamp; empty for tables, and without
            ``header`` where messages have none.
    """

    values: dict[Origin, Array] = field(default_factory=dict)
    stamps: dict[str, NDArray[np.int64]] = field(default_factory=dict)


def format_of(path: Path, mapping: Mapping) -> str:
    """Format of a file, from the mapping or the ending of its name.

    Raises:
        InputError: there is no such file, or its ending tells nothing.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if mapping.format is not None:
        return mapping.format
    if path.is_dir():
        return "ros2"
    found = _FORMATS.get(path.suffix.lower())
    if found is None:
        raise InputError(
            f"{path}: the ending {path.suffix!r} tells no format; allowed: {', '.join(_FORMATS)}, "
            f"or a format in the mapping"
        )
    return found


def read(path: Path, mapping: Mapping, origins: Sequence[Origin]) -> dict[str, Samples]:
    """Read what the mapping names.

    Args:
        path: the recording.
        mapping: its mapping.
        origins: the columns or fields that are wanted.

    Returns:
        By topic; a table is the topic ``""``.

    Raises:
        InputError: a file, column, topic or field that is not there, or numbers that are none.
    """
    kind = format_of(path, mapping)
    tabular = kind in ("csv", "parquet")
    for origin in origins:
        if tabular and origin.column is None:
            raise InputError(f"{path}: a {kind} file has columns; the mapping names topic {origin.topic!r}")
        if not tabular and origin.topic is None:
            raise InputError(
                f"{path}: read as {kind} it has topics; the mapping names column {origin.column!r}"
            )
    if tabular:
        names = list(dict.fromkeys(str(origin.column) for origin in origins))
        table = _read_csv(path, mapping, names) if kind == "csv" else _read_parquet(path, names)
        return {"": Samples({origin: table[str(origin.column)] for origin in origins})}
    messages = _mcap_messages if kind == "mcap" else _bag_messages
    return _read_topics(path, origins, messages)


def missing(path: Path, what: str, name: str, there: Iterable[str]) -> InputError:
    """The error for a name that is not in the file, with the nearest that are."""
    known = list(there)
    near = get_close_matches(name, known, 3, 0.5)
    lower = [k for k in known if k.lower() == name.lower()]
    listed = ", ".join(lower or near) or ", ".join(known[:12]) + (" ..." if len(known) > 12 else "")
    return InputError(f"{path}: no {what} {name!r}; {'nearest' if near or lower else 'there are'}: {listed}")


def _read_csv(path: Path, mapping: Mapping, names: Sequence[str]) -> dict[str, Array]:
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            for _ in range(mapping.skip_lines):
                next(file, None)
            lines = csv.reader(file, delimiter=mapping.separator, skipinitialspace=True)
            head = [name.strip() for name in next(lines, [])]
            if not head:
                raise InputError(f"{path}: it is empty")
            for name in names:
                if name not in head:
                    raise missing(path, "column", name, head)
            places = [head.index(name) for name in names]
            columns: list[list[float]] = [[] for _ in names]
            for cells in lines:
                if not any(cells):
                    continue
                for column, name, place in zip(columns, names, places, strict=True):
                    column.append(_number(cells, place, path, lines.line_num + mapping.skip_lines, name))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from None
    return {name: np.array(column) for name, column in zip(names, columns, strict=True)}


def _number(cells: list[str], place: int, path: Path, line: int, name: str) -> float:
    if place >= len(cells):
        raise InputError(
            f"{path}:{line}: the line has {len(cells)} cells; column {name!r} is number {place + 1}"
        )
    text = cells[place].strip()
    try:
        return float(text) if text else np.nan
    except ValueError:
        raise InputError(f"{path}:{line}: column {name!r}: found {text[:40]!r}, expected a number") from None


def _read_parquet(path: Path, names: Sequence[str]) -> dict[str, Array]:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise InputError("reading Parquet needs the package pyarrow: pip install 'hdsim[parquet]'") from None
    try:
        file = pq.ParquetFile(path)
        there = file.schema_arrow.names
        for name in names:
            if name not in there:
                raise missing(path, "column", name, there)
        table = file.read(columns=list(names))
        return {name: np.asarray(table[name].to_numpy(), np.float64) for name in names}
    except (pa.ArrowException, OSError, ValueError, TypeError) as error:
        raise InputError(f"{path}: cannot be read as Parquet: {error}") from None


_Message = tuple[str, int, int, Callable[[], Any]]
"""Topic, log time and publish time in ns, and what decodes the body."""


def _read_topics(
    path: Path, origins: Sequence[Origin], messages: Callable[[Path, set[str]], Iterator[_Message]]
) -> dict[str, Samples]:
    by_topic: dict[str, list[Origin]] = {}
    for origin in origins:
        by_topic.setdefault(str(origin.topic), []).append(origin)
    rows: dict[str, list[list[float]]] = {topic: [] for topic in by_topic}
    stamps: dict[str, list[tuple[int, int, int | None]]] = {topic: [] for topic in by_topic}
    for topic, logged, published, decode in messages(path, set(by_topic)):
        place = f"{path}: {topic}"
        try:
            message = decode()
        except Exception as error:  # whatever a decoder says of bytes that are not its own
            number = len(rows[topic]) + 1
            raise InputError(f"{place}: message {number} cannot be decoded: {error}") from None
        rows[topic].append([_pick(message, origin, place) for origin in by_topic[topic]])
        stamps[topic].append((logged, published, _header_time(message)))
    found = {}
    for topic, wanted in by_topic.items():
        values = np.array(rows[topic], np.float64).reshape(-1, len(wanted))
        found[topic] = Samples({origin: values[:, k] for k, origin in enumerate(wanted)})
        for kind, of_kind in zip(
            ("log", "publish", "header"), zip(*stamps[topic], strict=True), strict=False
        ):
            if None not in of_kind:
                found[topic].stamps[kind] = np.array(of_kind, np.int64)
    return found


def _header_time(message: Any) -> int | None:
    try:
        stamp = _member(_member(message, "header"), "stamp")
        nanoseconds = "nanosec" if _has(stamp, "nanosec") else "nsec"
        return int(_member(stamp, "sec")) * 1_000_000_000 + int(_member(stamp, nanoseconds))
    except (KeyError, AttributeError, TypeError, ValueError):
        return None


def _has(value: Any, name: str) -> bool:
    return name in value if isinstance(value, dict) else hasattr(value, name)


def _member(value: Any, name: str) -> Any:
    return value[name] if isinstance(value, dict) else getattr(value, name)


def _fields(value: Any) -> list[str]:
    if isinstance(value, dict):
        return list(value)
    descriptor = getattr(value, "DESCRIPTOR", None)
    if descriptor is not None:
        return [f.name for f in descriptor.fields]
    return list(getattr(value, "__dataclass_fields__", {}) or getattr(value, "__slots__", []))


def _pick(message: Any, origin: Origin, place: str) -> float:
    """The number that an origin means in a message; NaN where the message leaves it out."""
    value: Any = message
    for part in str(origin.field).split("."):
        name, *indices = re.findall(r"[^\[\]]+", part)
        try:
            value = _member(value, name)
        except (KeyError, AttributeError):
            there = ", ".join(n for n in _fields(value) if not n.startswith("_"))
            raise InputError(f"{place}: no field {origin.field!r}; there are: {there}") from None
        for index in indices:
            try:
                value = value[int(index)]
            except (ValueError, IndexError, TypeError):
                raise InputError(f"{place}: {origin.field!r}: there is no element {index}") from None
    if origin.joint is not None:
        names = list(_member(message, "name")) if _has(message, "name") else []
        if origin.joint not in names:
            raise missing(Path(place), "joint", origin.joint, names)
        if len(value) == 0:
            return np.nan
        value = value[names.index(origin.joint)]
    try:
        return float(value)
    except (TypeError, ValueError):
        hint = ": name an element, such as [0], or a joint" if hasattr(value, "__len__") else ""
        raise InputError(f"{place}: field {origin.field!r} is no number{hint}") from None


def _mcap_messages(path: Path, topics: set[str]) -> Iterator[_Message]:
    import struct

    from mcap.exceptions import McapError
    from mcap.reader import make_reader
    from zstandard import ZstdError

    decoders: dict[int, Callable[[bytes], Any]] = {}
    try:
        with open(path, "rb") as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            if summary is not None:
                there = [channel.topic for channel in summary.channels.values()]
                for topic in sorted(topics - set(there)):
                    raise missing(path, "topic", topic, there)
            for schema, channel, message in reader.iter_messages(topics=list(topics)):
                if channel.id not in decoders:
                    decoders[channel.id] = _decoder(path, channel, schema)
                decode, body = decoders[channel.id], message.data
                yield (
                    channel.topic,
                    message.log_time,
                    message.publish_time,
                    lambda decode=decode, body=body: decode(body),  # type: ignore[misc]
                )
    except (McapError, ZstdError, OSError, EOFError, RuntimeError, struct.error) as error:
        words = str(error) or type(error).__name__
        raise InputError(f"{path}: cannot be read as MCAP, it is cut off or damaged: {words}") from None


def _decoder(path: Path, channel: Any, schema: Any) -> Callable[[bytes], Any]:
    """What decodes the messages of a channel."""
    if channel.message_encoding == "json":
        return json.loads
    if channel.message_encoding == "protobuf" and schema is not None:
        from hdsim.log.schemas import message_class

        try:
            kind: Any = message_class(schema.name, schema.data)
        except ValueError as error:
            raise InputError(f"{path}: {channel.topic}: {error}") from None
        decode: Callable[[bytes], Any] = kind.FromString
        return decode
    if channel.message_encoding == "cdr" and schema is not None and schema.encoding == "ros2msg":
        try:
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError:
            raise InputError(_ROS_HINT) from None
        store = get_typestore(Stores.EMPTY)
        name = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/", 1)
        store.register(get_types_from_msg(schema.data.decode(), name))
        return lambda body: store.deserialize_cdr(body, name)
    raise InputError(
        f"{path}: {channel.topic} is encoded as {channel.message_encoding!r}; allowed: json, protobuf, "
        f"cdr with a ros2msg schema"
    )


def _bag_messages(path: Path, topics: set[str]) -> Iterator[_Message]:
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(_ROS_HINT) from None
    folder = path if path.is_dir() else path.parent
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.LATEST)) as reader:
            there = list(reader.topics)
            for topic in sorted(topics - set(there)):
                raise missing(path, "topic", topic, there)
            chosen = [c for c in reader.connections if c.topic in topics]
            for connection, at, body in reader.messages(connections=chosen):
                yield (
                    connection.topic,
                    at,
                    at,
                    lambda body=body, kind=connection.msgtype: reader.deserialize(body, kind),  # type: ignore[misc]
                )
    except (AnyReaderError, OSError) as error:
        raise InputError(f"{path}: cannot be read as a ROS 2 bag: {error}") from None
