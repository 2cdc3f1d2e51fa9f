"""MATLAB's files: versions 5 to 7 by SciPy, 7.3 (which is HDF5) by h5py."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import InputError
from hdsim.log.readers.contract import Numbers, Table, Tell, even, numeric, silent
from hdsim.log.readers.hdf5 import MOST_COLUMNS, open_hdf5

if TYPE_CHECKING:
    from hdsim.log.mapping import Form

_HDF5_BEGINS = b"\x89HDF\r\n\x1a\n"


def open_table(path: Path, form: Form | None = None) -> Table:
    """Open a MATLAB file; a column is a variable, ``structure.field`` or ``matrix[2]`` (from 0)."""
    try:
        with open(path, "rb") as file:
            head = file.read(520)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if head.startswith(_HDF5_BEGINS) or head[512:].startswith(_HDF5_BEGINS):
        return open_hdf5(path, ".", "MATLAB 7.3")
    from scipy.io import loadmat

    try:
        variables = loadmat(path, simplify_cells=True)
    except Exception as error:  # SciPy's reader says of damaged files whatever went wrong first
        raise InputError(f"{path}: cannot be read as a MATLAB file: {error}") from None
    columns = dict(_columns({k: v for k, v in variables.items() if not k.startswith("__")}, ""))
    if not columns:
        raise InputError(
            f"{path}: no variable holds a column of numbers (timetables and tables: save arrays)"
        )
    return _Matlab(path, columns)


def _columns(variables: dict[str, Any], before: str) -> Iterator[tuple[str, Any]]:
    for name, value in variables.items():
        if isinstance(value, dict):
            yield from _columns(value, f"{before}{name}.")
            continue
        array = np.asarray(value)
        if array.dtype.kind not in "biuf" or array.size < 2 or array.ndim > 2:
            continue
        if array.ndim == 1:
            yield f"{before}{name}", array
        elif min(array.shape) <= MOST_COLUMNS:
            for k, column in enumerate(array.T if array.shape[1] <= array.shape[0] else array):
                yield f"{before}{name}[{k}]", column


class _Matlab(Table):
    def __init__(self, path: Path, columns: dict[str, Any]) -> None:
        super().__init__(path, list(columns))
        self.columns = list(columns.values())

    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        names = [self.names[place] for place in places]
        found = [numeric(self.columns[p][:rows], self.path, n) for p, n in zip(places, names, strict=True)]
        even(self.path, found, names)
        return found
