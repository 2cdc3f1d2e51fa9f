"""Tables of a log for other programs: CSV and Parquet; its joint states as a bag for ROS 2."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdsim.errors import InputError
from hdsim.log.reader import open_log

if TYPE_CHECKING:
    from hdsim.recording import Table

_FORMATS = (".csv", ".parquet", ".mcap")
_ROWS_AT_ONCE = 10_000


def export_log(path: str | Path, out: str | Path, table: str = "state") -> Path:
    """Write one table of a log as CSV or Parquet, chosen by the name of ``out``.

    CSV: one header line with units, ``motor_angle [rad]``; numbers with as many digits as bring back the
    same double; columns of arrays as ``normal_force[0] [N]``, ``normal_force[1] [N]``, ...
    Parquet: the same columns, arrays as lists, units and descriptions in each field's metadata.
    MCAP: no table but the joint states, as a bag that programs of ROS 2 read.

    Args:
        path: a log.
        out: file to write, ``.csv``, ``.parquet`` or ``.mcap``.
        table: name of the table.

    Returns:
        ``out``.

    Raises:
        InputError: unknown table or format, a log that cannot be read, or no pyarrow for Parquet.
    """
    out = Path(out)
    if out.suffix not in _FORMATS:
        raise InputError(f"{out} has the ending {out.suffix!r}; allowed: {', '.join(_FORMATS)}")
    if out.suffix == ".mcap":
        from hdsim.log.ros_bag import write_bag

        if table != "state":
            raise InputError(f"--table: found {table}; an .mcap holds the joint states only")
        if out.exists() and Path(path).exists() and out.samefile(path):
            raise InputError(f"{out} is the log itself; a bag needs another name")
    else:
        recording = open_log(path)
        if table not in recording.tables:
            names = ", ".join(recording.tables) or "none"
            raise InputError(f"{path} has no table {table!r}; there are: {names}")
        chosen = recording.tables[table]
    partial = out.with_name(out.name + ".partial")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        if out.suffix == ".mcap":
            write_bag(Path(path), partial)
        elif out.suffix == ".csv":
            _write_csv(chosen, partial)
        else:
            _write_parquet(chosen, partial)
        os.replace(partial, out)
    except OSError as error:
        raise InputError(f"{out} cannot be written: {error.strerror}") from None
    finally:
        partial.unlink(missing_ok=True)
    return out


def _header(table: Table) -> Iterator[str]:
    yield "time [s]"
    for name, column in table.columns.items():
        unit = f" [{column.unit}]" if column.unit else ""
        if column.values.ndim == 1:
            yield name + unit
        else:
            yield from (f"{name}[{i}]{unit}" for i in range(column.values.shape[1]))


def _write_csv(table: Table, out: Path) -> None:
    with open(out, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_header(table))
        for begin in range(0, len(table), _ROWS_AT_ONCE):
            rows = slice(begin, begin + _ROWS_AT_ONCE)
            block = np.column_stack([table.time[rows], *(c.values[rows] for c in table.columns.values())])
            # csv writes a float by its repr, the shortest text that gives the same double.
            writer.writerows(block.tolist())


def _write_parquet(table: Table, out: Path) -> None:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise InputError("Parquet needs pyarrow: pip install 'hdsim[parquet]', or export to .csv") from None
    fields = [pa.field("time", pa.float64(), metadata={"unit": "s"})]
    arrays = [pa.array(table.time)]
    for name, column in table.columns.items():
        values = np.ascontiguousarray(column.values, np.float64)
        array = pa.array(values.ravel())
        if values.ndim == 2:
            array = pa.FixedSizeListArray.from_arrays(array, values.shape[1])
        metadata = {"unit": column.unit, "description": column.description}
        fields.append(pa.field(name, array.type, metadata=metadata))
        arrays.append(array)
    parquet.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), out)
