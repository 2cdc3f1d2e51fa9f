"""HDF5 files (and MATLAB's since 7.3, which are such), by h5py; only the columns asked for are read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import InputError
from hdsim.log.readers.contract import Numbers, Table, Tell, even, needed, numeric, silent

if TYPE_CHECKING:
    from hdsim.log.mapping import Form

#: Most columns of a matrix that are offered one by one; a wider one is no table of channels.
MOST_COLUMNS = 64
_READABLE = "biuf"


def open_table(path: Path, form: Form | None = None) -> Table:
    """Open an HDF5 file; a column is ``group/dataset``, ``matrix[2]`` (from 0) or ``table/field``."""
    return open_hdf5(path, "/", "HDF5")


def open_hdf5(path: Path, bar: str, what: str) -> Table:
    """Open an HDF5 file whose groups are written with ``bar`` between them."""
    h5py = needed("h5py", "h5py", "hdf5", what)
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise InputError(f"{path}: cannot be read as {what}: {error}") from None
    names: list[str] = []
    units: dict[int, str] = {}
    places: list[tuple[str, Any]] = []

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or not item.size:
            return
        unit = item.attrs.get("unit", item.attrs.get("units", ""))
        for title, part in _parts(item):
            if isinstance(unit, str | bytes) and unit:
                units[len(names)] = unit.decode() if isinstance(unit, bytes) else unit
            names.append(name.replace("/", bar) + title.replace("/", bar))
            places.append((name, part))

    file.visititems(visit)
    if not names:
        raise InputError(f"{path}: no dataset holds a column of numbers")
    return _Hdf5(path, names, units, file, places)


def _parts(item: Any) -> list[tuple[str, Any]]:
    """Columns of a dataset: what to add to its name, and how to index it."""
    if item.dtype.names:
        return [
            (f"/{field}", field)
            for field in item.dtype.names
            if item.dtype[field].kind in _READABLE and not item.dtype[field].shape
        ] if len(item.shape) == 1 else []  # fmt: skip
    if item.dtype.kind not in _READABLE or item.size < 2 or len(item.shape) > 2:
        return []
    if len(item.shape) == 1 or 1 in item.shape:
        return [("", ())]
    rows, columns = item.shape
    if min(rows, columns) > MOST_COLUMNS:
        return []
    if columns <= rows:
        return [(f"[{k}]", (slice(None), k)) for k in range(columns)]
    return [(f"[{k}]", (k, slice(None))) for k in range(rows)]


class _Hdf5(Table):
    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        units: dict[int, str],
        file: Any,
        places: list[tuple[str, Any]],
    ) -> None:
        super().__init__(path, names, units)
        self.file = file
        self.parts = places

    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        found = []
        for k, place in enumerate(places):
            name, part = self.parts[place]
            try:
                values = self.file[name][part]
            except (OSError, ValueError) as error:
                raise InputError(f"{self.path}: {name}: cannot be read: {error}") from None
            found.append(numeric(np.asarray(values).reshape(-1)[:rows], self.path, name))
            tell((k + 1) / len(places))
        even(self.path, found, [self.names[place] for place in places])
        return found
