"""Parquet files, by pyarrow; the columns that are asked for, a group of rows at a time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import InputError
from hdsim.log.readers.contract import Numbers, Table, Tell, needed, numeric, silent

if TYPE_CHECKING:
    from hdsim.log.mapping import Form


def open_table(path: Path, form: Form | None = None) -> Table:
    """Open a Parquet file; see `Table`."""
    pq = needed("pyarrow", "pyarrow.parquet", "parquet", "Parquet")
    try:
        file = pq.ParquetFile(path)
    except (OSError, ValueError) as error:  # pyarrow's own derive from these
        raise InputError(f"{path}: cannot be read as Parquet: {error}") from None
    return _Parquet(path, file)


class _Parquet(Table):
    def __init__(self, path: Path, file: Any) -> None:
        super().__init__(path, file.schema_arrow.names)
        self.file = file

    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        names = [self.names[place] for place in places]
        parts: list[list[Numbers]] = [[] for _ in names]
        whole = self.file.metadata.num_rows
        done = 0
        try:
            for batch in self.file.iter_batches(columns=list(dict.fromkeys(names))):
                for part, name in zip(parts, names, strict=True):
                    cells = batch.column(batch.schema.get_field_index(name)).to_numpy(zero_copy_only=False)
                    if cells.dtype == object and all(isinstance(c, bool | int | float | None) for c in cells):
                        cells = np.array([np.nan if c is None else c for c in cells], np.float64)
                    part.append(numeric(cells, self.path, name))
                done += batch.num_rows
                tell(done / max(whole, 1))
                if rows is not None and done >= rows:
                    break
        except (OSError, ValueError) as error:
            raise InputError(f"{self.path}: cannot be read as Parquet: {error}") from None
        return [np.concatenate(part)[:rows] if part else np.zeros(0) for part in parts]
