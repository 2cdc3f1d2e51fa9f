"""What a log of hdsim calls things: topics, message types, fields, metadata records, and its clock."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError

if TYPE_CHECKING:
    from hdsim.recording import Column

Array = NDArray[np.float64]

EPOCH_NS = 1_577_836_800_000_000_000
"""Time zero of every run: 2020-01-01T00:00:00 UTC, in ns since 1970.

It is fixed so that equal runs give equal files and runs line up in a viewer, and not zero because viewers
take a time near zero for a broken clock.
"""

PREFIX = "/hd/"
STATIC_TOPIC = "/hd/static"
EVENT_TOPIC = "/hd/events"
VIEW_SUFFIX = "_view"
LOOP_SUFFIX = "_loop"
RUN_TABLES = ("state", "measured")
"""Tables that may hold a run itself, simulated or measured."""
VIEWED_TABLES = (*RUN_TABLES, "before", "refit", "after")
"""Tables that viewers plot: runs, alone or held against each other."""
ORIGIN_KEY = "recorded"
MEASURED = "measured"
"""Metadata ``recorded: measured``: the state of that recording is the table ``measured`` of its log."""
PROTOBUF_PACKAGE = "hdsim"

RUN_RECORD = "hdsim.run"
STATISTICS_RECORD = "hdsim.statistics"
INCOMPLETE_RECORD = "hdsim.incomplete"
RECOVERED_RECORD = "hdsim.recovered"
TABLE_RECORD = "hdsim.table."

RESERVED_TABLES = frozenset(
    {"static", "static_view", "events", "scene", "scene_static", "transforms"}
    | {"states", "orders", "over_angle"}
    | {table + suffix for table in VIEWED_TABLES for suffix in (VIEW_SUFFIX, LOOP_SUFFIX)}
)

_MEDIA_TYPES = {".yaml": "application/yaml", ".yml": "application/yaml", ".json": "application/json"}
_LATEST_S = 7e9
_EARLIEST_S = -1.5e9


def to_ns(time: Array) -> NDArray[np.int64]:
    """Log times of run times.

    Args:
        time: seconds from the start of the run, any shape.

    Returns:
        Nanoseconds since 1970, same shape, rounded to the nearest.

    Raises:
        InputError: a time is not finite or more than two centuries away.
    """
    if time.size and not bool(np.all((time > _EARLIEST_S) & (time < _LATEST_S))):
        bad = time[~((time > _EARLIEST_S) & (time < _LATEST_S))].flat[0]
        raise InputError(
            f"time {float(bad)!r} s cannot be logged; allowed: {_EARLIEST_S:g} s to {_LATEST_S:g} s"
        )
    return np.rint(time * 1e9).astype(np.int64) + EPOCH_NS


def media_type_of(name: str) -> str:
    """Media type of an attachment, by the ending of its file name."""
    return _MEDIA_TYPES.get(PurePath(name).suffix, "application/octet-stream")


def topic_of(table: str) -> str:
    """Topic of a table, refused where the name would not make one."""
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", table):
        raise InputError(f"table name {table!r} cannot be a topic; allowed: letters, digits and _")
    if table in RESERVED_TABLES:
        raise InputError(f"table name {table!r} is taken; reserved: {', '.join(sorted(RESERVED_TABLES))}")
    return PREFIX + table


def message_type_of(table: str) -> str:
    """Protobuf message type of a table: ``state`` is ``hdsim.State``, ``my_table`` is ``hdsim.MyTable``."""
    camel = "".join(part[:1].upper() + part[1:] for part in table.split("_"))
    return f"{PROTOBUF_PACKAGE}.{camel or 'Table'}"


def field_number(index: int) -> int:
    """Number of a message's field by its position from 0, leaving out 19000-19999, which protobuf keeps."""
    return index + 1 if index < 18_999 else index + 1_001


@dataclass(frozen=True)
class ColumnSpec:
    """What a log says about a column.

    Args:
        name: name in the recording.
        field: name in the message.
        unit: SI unit.
        description: one line.
        shape: what one row holds: () for a number, (k,) for k of them; for static arrays the whole shape.
    """

    name: str
    field: str
    unit: str
    description: str
    shape: tuple[int, ...]

    @property
    def repeated(self) -> bool:
        """Whether a row holds an array."""
        return len(self.shape) > 0

    @property
    def size(self) -> int:
        """Number of doubles in a row."""
        return int(np.prod(self.shape, dtype=np.int64))


def describe_columns(columns: Mapping[str, Column], *, rows: bool) -> list[ColumnSpec]:
    """Columns of a table (``rows``: the first axis is time), or static arrays.

    Raises:
        InputError: an array that is not of numbers or, in a table, not of shape (n,) or (n, k).
    """
    specs: list[ColumnSpec] = []
    used = {"time"} if rows else set()
    for name, column in columns.items():
        values = np.asarray(column.values)
        if not np.can_cast(values.dtype, np.float64):
            raise InputError(f"column {name!r} holds {values.dtype}; allowed: numbers that fit a double")
        if rows and values.ndim not in (1, 2):
            raise InputError(f"column {name!r} has shape {values.shape}; allowed: (n,) or (n, k)")
        shape = values.shape[1:] if rows else values.shape
        field = re.sub(r"[^A-Za-z0-9_]", "_", name) or "_"
        if field[0].isdigit():
            field = "_" + field
        while field in used:
            field += "_"
        used.add(field)
        specs.append(ColumnSpec(name, field, column.unit, column.description, tuple(map(int, shape))))
    return specs


def columns_to_json(specs: Iterable[ColumnSpec]) -> str:
    """Column descriptions as JSON, for channel metadata and metadata records."""
    return json.dumps(
        [
            {
                "name": s.name,
                "field": s.field,
                "unit": s.unit,
                "description": s.description,
                "shape": list(s.shape),
            }
            for s in specs
        ],
        allow_nan=False,
    )


def columns_from_json(text: str) -> list[ColumnSpec]:
    """Inverse of `columns_to_json`.

    Raises:
        InputError: the text is not what `columns_to_json` writes.
    """
    try:
        return [
            ColumnSpec(
                str(c["name"]),
                str(c["field"]),
                str(c["unit"]),
                str(c["description"]),
                tuple(int(k) for k in c["shape"]),
            )
            for c in json.loads(text)
        ]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"the log's column description is damaged: {error!r}") from None
