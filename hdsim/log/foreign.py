"""Numbers out of recordings that others made, whatever their format (`hdsim.log.readers`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hdsim.errors import InputError
from hdsim.log.mapping import Mapping, Origin
from hdsim.log.readers import format_of
from hdsim.log.readers.contract import Tell, silent
from hdsim.log.readers.topics import Samples, read_topics


def read(path: Path, mapping: Mapping, origins: Sequence[Origin], tell: Tell = silent) -> dict[str, Samples]:
    """Read what the mapping names.

    Args:
        path: the recording.
        mapping: its mapping.
        origins: the columns or fields that are wanted.
        tell: hears which share has been read.

    Returns:
        By topic; a table is the topic ``""``.

    Raises:
        InputError: a file, column, topic or field that is not there, or numbers that are none.
    """
    kind = format_of(path, mapping)
    for origin in origins:
        if kind.tabular and origin.column is None:
            raise InputError(
                f"{path}: read as {kind.title} it has columns; the mapping names topic {origin.topic!r}"
            )
        if not kind.tabular and origin.topic is None:
            raise InputError(
                f"{path}: read as {kind.title} it has topics; the mapping names column {origin.column!r}"
            )
    if not kind.tabular:
        return read_topics(path, origins, kind.reader.messages)
    table = kind.reader.open_table(path, mapping)
    places = [table.place(origin.column) for origin in origins]
    return {"": Samples(dict(zip(origins, table.read(places, None, tell), strict=True)))}
