"""The result of a study as a tidy table: one row a run, units in the header and in the metadata."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.studies.engine.reading import Plan
from hdsim.studies.engine.worker import Row

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Variable:
    """A column.

    Args:
        name: of the parameter or metric.
        unit: of its values; empty for indices and text.
        description: one line.
        values: one a run: numbers, text or None.
        role: ``index``, ``parameter``, ``metric`` or ``outcome``.
    """

    name: str
    unit: str
    description: str
    values: list[Any]
    role: str


@dataclass(frozen=True)
class StudyTable:
    """All runs of a study in the order of their index.

    Args:
        columns: indices and seed, parameters, metrics, status and reason.
        provenance: text by name: definition, versions, seeds.
    """

    columns: dict[str, Variable]
    provenance: dict[str, str]

    def __len__(self) -> int:
        return len(self.columns["run"].values)

    def of(self, role: str) -> dict[str, Variable]:
        """Columns of a role, in order."""
        return {name: column for name, column in self.columns.items() if column.role == role}

    def values(self, name: str) -> Array:
        """A column of numbers, shape (runs,); NaN where there is none.

        Raises:
            InputError: there is no such column.
        """
        if name not in self.columns:
            raise InputError(f"no column {name!r}; there are: {', '.join(self.columns)}")
        return np.array([np.nan if v is None else float(v) for v in self.columns[name].values])

    def write_csv(self, path: Path) -> Path:
        """Write as CSV, units in the header as ``name [unit]``; floats with all their digits."""
        header = [c.name + (f" [{c.unit}]" if c.unit else "") for c in self.columns.values()]

        def write(partial: Path) -> None:
            with partial.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(header)
                for row in zip(*(c.values for c in self.columns.values()), strict=True):
                    writer.writerow(["" if v is None else v for v in row])

        return _whole(path, write)

    def write_parquet(self, path: Path) -> Path:
        """Write as Parquet: unit, description and role in every column's metadata, provenance in the file's.

        Raises:
            InputError: pyarrow is not installed.
        """
        try:
            import pyarrow as pa
            from pyarrow import parquet
        except ImportError:
            raise InputError(
                "Parquet needs pyarrow: pip install 'hdsim[parquet]'; the CSV has the same"
            ) from None
        arrays, fields = [], []
        for column in self.columns.values():
            kind = _arrow_type(pa, column)
            arrays.append(pa.array(column.values, type=kind))
            about = {"unit": column.unit, "description": column.description, "role": column.role}
            fields.append(pa.field(column.name, kind, metadata=about))
        table = pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=self.provenance))
        return _whole(path, lambda partial: parquet.write_table(table, partial))


def _arrow_type(pa: Any, column: Variable) -> Any:
    if column.role == "index":
        return pa.int64()
    kinds = {type(v) for v in column.values if v is not None}
    if column.role == "metric" or (kinds and kinds <= {int, float}):
        return pa.float64()
    return pa.bool_() if kinds == {bool} else pa.string()


def _whole(path: Path, write: Callable[[Path], object]) -> Path:
    """Write beside ``path`` and put it in place when it is whole."""
    partial = path.with_name(path.name + ".partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(partial)
        os.replace(partial, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error
    return path


def study_table(plan: Plan, rows: Mapping[int, Row]) -> StudyTable:
    """The table of a study from the rows of its runs.

    Args:
        plan: the study.
        rows: by run index; a run without a row is missing in the table.
    """
    runs = [run for run in plan.runs if run.index in rows]
    done = [rows[run.index] for run in runs]
    columns = [
        Variable("run", "", "index of the run", [r.index for r in runs], "index"),
        Variable("point", "", "index of the combination of stated values", [r.point for r in runs], "index"),
        Variable("sample", "", "index of the sample of the distributions", [r.sample for r in runs], "index"),
        Variable("replicate", "", "index of the drive at that point", [r.replicate for r in runs], "index"),
        Variable("seed", "", "seed of the run", [r.seed for r in runs], "index"),
    ]
    for k, name in enumerate(plan.study.parameters):
        values = [run.values[k] for run in runs]
        columns.append(Variable(name, plan.units[name], "parameter", _uniform(values), "parameter"))
    for metric in plan.metrics:
        values = [row.metrics.get(metric.name) for row in done]
        columns.append(Variable(metric.name, metric.unit, metric.description, values, "metric"))
    status = ["failed" if row.reason else "ok" for row in done]
    columns.append(Variable("status", "", "ok, or failed", status, "outcome"))
    columns.append(Variable("reason", "", "why it failed", [row.reason for row in done], "outcome"))
    return StudyTable({column.name: column for column in columns}, provenance(plan))


def _uniform(values: list[Any]) -> list[Any]:
    """Values of one type: mixed ones and sections become text."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} or kinds == {bool} or kinds == {str}:
        return values
    return [json.dumps(value, sort_keys=True) for value in values]


def provenance(plan: Plan) -> dict[str, str]:
    """What made the results: the study, its base, seeds, versions; nothing that changes
    between two machines.
    """
    from importlib.metadata import version

    from hdsim.studies.engine.journal import code_version, key_of

    return {
        "study_name": plan.study.name,
        "study": json.dumps(plan.study.model_dump(mode="json"), sort_keys=True),
        "base_scenario": plan.scenario.to_yaml(),
        "key": key_of(plan.definition),
        "code": code_version(),
        "seed": str(plan.study.seed),
        "metrics": json.dumps({m.name: {"unit": m.unit, "source": m.source} for m in plan.metrics}),
        **{f"version_{name}": version(name) for name in ("hdsim", "numpy", "scipy", "numba", "pydantic")},
    }
