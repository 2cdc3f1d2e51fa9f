"""Excel workbooks, by openpyxl, row by row. Columns of sheets after the first are ``Sheet!name``."""

from __future__ import annotations

import datetime
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import InputError
from hdsim.log.readers.cells import date, decimal_mark, kind, layout, number
from hdsim.log.readers.contract import Numbers, Table, Tell, even, needed, silent

if TYPE_CHECKING:
    from hdsim.log.mapping import Form

_LOOKED_AT = 200
_TOLD_EVERY = 5000


@dataclass(frozen=True)
class _Sheet:
    title: str
    first: int
    width: int
    decimal: str


def open_table(path: Path, form: Form | None = None) -> Table:
    """Open a workbook; see `Table`."""
    excel = needed("openpyxl", "openpyxl", "excel", "Excel workbooks")
    from zipfile import BadZipFile

    try:
        book = excel.load_workbook(path, read_only=True, data_only=True)
    except (OSError, BadZipFile, KeyError, ValueError, excel.utils.exceptions.InvalidFileException) as error:
        raise InputError(f"{path}: cannot be read as an Excel workbook: {error}") from None
    names: list[str] = []
    units: dict[int, str] = {}
    sheets: list[_Sheet] = []
    words: list[int] = []
    for sheet in book.worksheets:
        rows = list(islice(_rows(sheet), _LOOKED_AT))
        found = layout(rows)
        if found is None or found.first >= len(rows):
            continue  # a sheet of words
        texts = [cell for row in rows[found.first :] for cell in row if isinstance(cell, str)]
        decimal = (form.decimal if form else None) or decimal_mark(texts) or "."
        prefix = f"{sheet.title}!" if sheets else ""
        units |= {len(names) + k: unit for k, unit in found.units.items()}
        words += [len(names) + k for k in found.words]
        names += [f"{prefix}{name or k + 1}" if name or prefix else "" for k, name in enumerate(found.names)]
        sheets.append(_Sheet(sheet.title, found.first, len(found.names), decimal))
    if not sheets:
        raise InputError(f"{path}: no sheet holds a table of numbers")
    return _Excel(path, names, units, words, book, sheets)


class _Excel(Table):
    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        units: dict[int, str],
        words: list[int],
        book: Any,
        sheets: list[_Sheet],
    ) -> None:
        notes = [f"sheet {', '.join(sheet.title for sheet in sheets)}"]
        super().__init__(path, names, units, notes, words)
        self.book = book
        self.sheets = sheets

    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        found: dict[int, Numbers] = {}
        begin = 0
        for sheet in self.sheets:
            wanted = [place for place in places if begin <= place < begin + sheet.width]
            if wanted:
                columns = self._read(sheet, [place - begin for place in wanted], rows, tell)
                found |= dict(zip(wanted, columns, strict=True))
            begin += sheet.width
        columns = [found[place] for place in places]
        even(self.path, columns, [self.names[place] for place in places])
        return columns

    def _read(self, sheet: _Sheet, places: list[int], rows: int | None, tell: Tell) -> list[Numbers]:
        page = self.book[sheet.title]
        whole = page.max_row or 1
        numbers = [array("d") for _ in places]
        dates: dict[int, list[np.datetime64]] = {}
        last = None if rows is None else sheet.first + rows
        for index, row in enumerate(islice(_rows(page), sheet.first, last)):
            for k, place in enumerate(places):
                cell = row[place] if place < len(row) else None
                if kind(cell) == "d":
                    dates.setdefault(k, []).append(_moment(cell))
                    continue
                try:
                    numbers[k].append(
                        number(cell, sheet.decimal)
                        if isinstance(cell, str)
                        else np.nan
                        if cell is None
                        else cell
                    )
                except ValueError:
                    raise InputError(
                        f"{self.path}: sheet {sheet.title!r}, row {index + 1} of its numbers, column "
                        f"{place + 1}: found {str(cell)[:40]!r}, expected a number"
                    ) from None
            if index % _TOLD_EVERY == 0:
                tell(min(index / whole, 1.0))
        return [
            np.array(dates[k], "datetime64[ns]") if k in dates else np.array(numbers[k], np.float64)
            for k in range(len(places))
        ]


def _rows(sheet: Any) -> Iterator[list[Any]]:
    """Rows without the empty cells at their ends; no empty rows."""
    for row in sheet.iter_rows(values_only=True):
        cells = list(row)
        while cells and cells[-1] is None:
            cells.pop()
        if cells:
            yield cells


def _moment(cell: Any) -> np.datetime64:
    if isinstance(cell, str):
        return date(cell)
    if isinstance(cell, datetime.time):
        cell = datetime.datetime.combine(datetime.date(1970, 1, 1), cell)
    return np.datetime64(cell, "ns")
