"""Readers of other people's files: one module a format, and one line here.

A module of a table has ``open_table(path, form)``, which returns a `contract.Table`; one of messages has
``messages(path, topics)``, which yields `contract.Message`.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdsim.errors import InputError

if TYPE_CHECKING:
    from hdsim.log.mapping import Form


@dataclass(frozen=True)
class Format:
    """A format of recordings.

    Args:
        title: what people call it.
        module: its reader, in this package.
        endings: of its files' names.
        tabular: it has columns; else topics of messages.
    """

    title: str
    module: str
    endings: tuple[str, ...]
    tabular: bool = True

    @property
    def reader(self) -> Any:
        """The reader's module."""
        return import_module(f"{__name__}.{self.module}")


#: By the name that a mapping gives as ``format``.
FORMATS = {
    "csv": Format("CSV", "delimited", (".csv", ".tsv", ".txt", ".dat", ".asc")),
    "parquet": Format("Parquet", "parquet", (".parquet", ".pq")),
    "excel": Format("Excel", "excel", (".xlsx", ".xlsm")),
    "matlab": Format("MATLAB", "matlab", (".mat",)),
    "hdf5": Format("HDF5", "hdf5", (".h5", ".hdf5", ".hdf", ".nc")),
    "tdms": Format("TDMS", "tdms", (".tdms",)),
    "mdf": Format("MDF", "mdf", (".mf4", ".mdf")),
    "mcap": Format("MCAP", "mcap", (".mcap",), tabular=False),
    "ros1": Format("ROS 1 bag", "ros", (".bag",), tabular=False),
    "ros2": Format("ROS 2 bag", "ros", (".db3",), tabular=False),
}


def format_of(path: Path, form: Form | None = None) -> Format:
    """Format of a file, from the mapping or the ending of its name; a folder is a ROS 2 bag.

    Raises:
        InputError: there is no such file, or its ending tells nothing.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if form is not None and form.format is not None:
        return FORMATS[form.format]
    if path.is_dir():
        return FORMATS["ros2"]
    ending = path.suffix.lower()
    for found in FORMATS.values():
        if ending in found.endings:
            return found
    known = ", ".join(ending for found in FORMATS.values() for ending in found.endings)
    raise InputError(
        f"{path}: the ending {path.suffix!r} tells no format; allowed: {known}, or a format in the mapping"
    )
