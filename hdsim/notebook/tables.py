"""Recordings and studies as pandas' and xarray's tables, units in the attributes."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from hdsim.errors import InputError

if TYPE_CHECKING:
    import pandas
    import xarray

    from hdsim.recording import Column, Recording
    from hdsim.studies.engine.table import StudyTable

#: What the second axis of a table's columns is, and the axis of static arrays.
TOOTH = "tooth"


def to_pandas(recording: Recording, table: str = "state") -> pandas.DataFrame:
    """One table of a recording as a data frame; see ``Recording.to_pandas``."""
    pandas = _package("pandas")
    if table not in recording.tables:
        raise InputError(f"no table {table!r}; there are: {', '.join(recording.tables)}")
    found = recording.tables[table]
    columns = found.columns
    index = pandas.Index(found.time, name="time")
    if any(column.values.ndim > 1 for column in columns.values()):
        frames = {
            name: pandas.DataFrame(column.values.reshape(len(found), -1), index=index)
            for name, column in columns.items()
        }
        frame = pandas.concat(frames, axis=1, names=["channel", TOOTH])
    else:
        frame = pandas.DataFrame({name: column.values for name, column in columns.items()}, index=index)
    frame.attrs = {
        "units": {"time": "s", **{name: column.unit for name, column in columns.items()}},
        "descriptions": {name: column.description for name, column in columns.items()},
        **recording.metadata,
    }
    return frame


def to_xarray(recording: Recording) -> xarray.Dataset:
    """All tables of a recording as one dataset; see ``Recording.to_xarray``."""
    package = _package("xarray")
    variables: dict[str, Any] = {}
    clocks: dict[str, Any] = {}
    for table, found in recording.tables.items():
        clock = "time" if table == "state" else f"{table}_time"
        about = "time" if table == "state" else f"time of the table {table}"
        clocks[clock] = ((clock,), found.time, {"units": "s", "long_name": about})
        for name, column in found.columns.items():
            key = f"{table}_{name}" if name in variables or name in clocks else name
            dims = (clock,) if column.values.ndim == 1 else (clock, TOOTH)
            variables[key] = (dims, column.values, _attributes(column))
    for name, column in recording.static.items():
        variables[name] = ((TOOTH,), column.values, _attributes(column))
    dataset: xarray.Dataset = package.Dataset(variables, coords=clocks, attrs=dict(recording.metadata))
    return dataset


def study_to_pandas(table: StudyTable) -> pandas.DataFrame:
    """All runs of a study as a data frame, a row each; see ``StudyResult.to_pandas``."""
    pandas = _package("pandas")
    columns = table.columns
    frame = pandas.DataFrame({name: column.values for name, column in columns.items() if name != "run"})
    frame.index = pandas.Index(columns["run"].values, name="run")
    frame.attrs = {
        "units": {name: column.unit for name, column in columns.items() if column.unit},
        "descriptions": {name: column.description for name, column in columns.items()},
        **table.provenance,
    }
    return frame


def _attributes(column: Column) -> dict[str, str]:
    """Unit and description under the names that CF conventions and xarray's plots know."""
    return {"units": column.unit, "long_name": column.description}


def _package(name: str) -> Any:
    """An optional package.

    Raises:
        InputError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError:
        raise InputError(f"this needs the package {name}: pip install 'hdsim[notebook]'") from None
