"""Recordings out of columns that are in memory already, such as those of a data frame."""

from __future__ import annotations

from collections.abc import Mapping as Columns
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hdsim.errors import InputError
from hdsim.log.importing import Import
from hdsim.log.mapping import Mapping, Origin
from hdsim.log.mapping_source import mapping_of
from hdsim.log.readers.contract import Tell, missing
from hdsim.log.readers.topics import Samples
from hdsim.recording import Recording


def import_columns(
    columns: Columns[str, ArrayLike], mapping: str | Path | dict[str, Any] | Mapping, name: str = "columns"
) -> Recording:
    """What `import_recording` makes of a table's file, of columns in memory.

    Args:
        columns: shape (n,) each, by name.
        mapping: as for `import_recording`; it names columns.
        name: for messages.

    Raises:
        InputError: the mapping is wrong or does not fit the columns.
    """

    def read(path: Path, _: Mapping, origins: Sequence[Origin], tell: Tell) -> dict[str, Samples]:
        return {"": Samples({origin: _numbers(columns, origin, path) for origin in origins})}

    return Import(Path(name), mapping_of(mapping), read=read).recording()


def _numbers(columns: Columns[str, ArrayLike], origin: Origin, path: Path) -> Any:
    """One column as numbers, shape (n,)."""
    if origin.column is None:
        raise InputError(f"{path}: columns have no topics; the mapping names topic {origin.topic!r}")
    name = origin.column
    if isinstance(name, int):
        if not 1 <= name <= len(columns):
            raise InputError(f"{path}: no column {name}; there are {len(columns)}")
        name = list(columns)[name - 1]
    if name not in columns:
        raise missing(path, "column", name, columns)
    try:
        found = np.asarray(columns[name], np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{path}: column {name!r}: found something that is no number") from None
    many = {len(np.asarray(values)) for values in columns.values()}
    if found.ndim != 1 or len(many) > 1:
        raise InputError(f"{path}: column {name!r}: expected columns of one length, shape (n,)")
    return found
