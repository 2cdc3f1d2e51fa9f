"""Text tables (CSV and its kin): encoding, separator, decimal mark, names and units found; read in chunks."""

from __future__ import annotations

import codecs
import csv
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from io import TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from hdsim.errors import InputError
from hdsim.log.readers.cells import MISSING, Layout, date, decimal_mark, kind, layout, number
from hdsim.log.readers.contract import Numbers, Table, Tell, silent

if TYPE_CHECKING:
    from hdsim.log.mapping import Form

#: Lines from which the form of a file is found, and lines that are read at a time.
LOOKED_AT = 400
CHUNK = 20_000
_BLOCK = 1 << 20
_ALONE = 0.4
_COMMENT = ("#", "%", "//", "!")
_SEPARATORS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "space"}
_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}


def open_table(path: Path, form: Form | None = None) -> Table:
    """Look at the beginning of a text table.

    Raises:
        InputError: the file is none, or its decimal mark cannot be told.
    """
    encoding = (form.encoding if form else None) or _encoding(path)
    skipped = form.skip_lines if form else 0
    try:
        with open(path, newline="", encoding=encoding) as file:
            lines = list(islice(file, skipped + LOOKED_AT))[skipped:]
    except (OSError, UnicodeError, LookupError) as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from None
    comments = [line for line in lines if _is_comment(line)]
    lines = [line for line in lines if line.strip() and not _is_comment(line)]
    if not lines:
        raise InputError(f"{path}: it is empty")
    try:
        separator = (form.separator if form else None) or _separator(lines)
        rows = list(_rows(iter(lines), separator))
        bare = [row for line in comments for row in _rows(iter([line.strip().lstrip("#%/! ")]), separator)]
    except csv.Error as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from None
    found = layout(rows, bare)
    if found is None:
        raise InputError(f"{path}: it is empty")
    if found.first == len(rows) > 1:
        raise InputError(
            f"{path}: cannot be read as CSV: no line holds numbers; the first is {lines[0].strip()[:40]!r}"
        )
    cells = [cell for row in rows[found.first :] for cell in row]
    decimal = (form.decimal if form else None) or decimal_mark(cells)
    if decimal is None:
        example = next(cell for cell in cells if "," in cell)
        raise InputError(
            f"{path}: {example!r} may be a decimal comma or a group of thousands: say `decimal: ','` or "
            f"`decimal: '.'` in the mapping (`--decimal` of hdsim mapping)"
        )
    return _Delimited(path, encoding, separator, decimal, skipped, found)


class _Delimited(Table):
    def __init__(
        self, path: Path, encoding: str, separator: str, decimal: str, skipped: int, found: Layout
    ) -> None:
        notes = [f"{_SEPARATORS.get(separator, repr(separator))} between columns", f"decimal {decimal!r}"]
        if encoding not in ("utf-8", "ascii"):
            notes.append(encoding)
        if found.headless:
            notes.append("no names: columns by their number")
        if found.units:
            notes.append("a row of units")
        super().__init__(path, found.names, found.units, notes, found.words)
        self.encoding = encoding
        self.separator = separator
        self.decimal = decimal
        self.skipped = skipped
        self.first = found.first

    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        columns = [_Growing(self, place) for place in places]
        size = max(self.path.stat().st_size, 1)
        try:
            with open(self.path, "rb") as raw, TextIOWrapper(raw, self.encoding, newline="") as file:
                for _ in range(self.skipped):
                    next(file, None)
                table = _Numbered(file, self.skipped)
                body = islice(_rows(iter(table), self.separator), self.first, None)
                left = rows
                while left is None or left > 0:
                    chunk = list(islice(body, CHUNK if left is None else min(CHUNK, left)))
                    if not chunk:
                        break
                    left = None if left is None else left - len(chunk)
                    for column in columns:
                        column.extend(chunk, table.line)
                    tell(min(raw.tell() / size, 1.0))
        except (OSError, UnicodeError, csv.Error) as error:
            raise InputError(f"{self.path}: cannot be read as CSV: {error}") from None
        return [column.whole() for column in columns]

    def line_of(self, row: int) -> int:
        """Line of the file, from 1, in which a row of numbers stands."""
        with open(self.path, newline="", encoding=self.encoding) as file:
            for _ in range(self.skipped):
                next(file, None)
            table = _Numbered(file, self.skipped)
            next(islice(_rows(iter(table), self.separator), self.first + row, None), None)
            return table.line


class _Growing:
    """A column while it is read: 8 bytes a number."""

    def __init__(self, table: _Delimited, place: int) -> None:
        self.table = table
        self.place = place
        self.name = table.names[place] or str(place + 1)
        self.numbers = array("d")
        self.dates: list[Numbers] = []
        self.count = 0

    def extend(self, rows: list[list[str]], last_line: int) -> None:
        place, decimal = self.place, self.table.decimal
        try:
            cells = [row[place] for row in rows]
        except IndexError:
            row = next(k for k, row in enumerate(rows) if len(row) <= place)
            raise self._wrong(
                row, f"the line has {len(rows[row])} cells; column {self.name!r} is number {place + 1}"
            ) from None
        if self.dates or (not self.count and next((kind(c) for c in cells if kind(c) != "e"), "") == "d"):
            self._extend_dates(cells)
        else:
            # NumPy's own conversion is many times faster, and knows plain numbers alone.
            swapped = cells
            if decimal == ",":
                swapped = ["." if "." in cell else cell.replace(",", ".") for cell in cells]
            try:
                self.numbers.frombytes(np.array(swapped, np.float64).tobytes())
            except ValueError:
                self._extend_slowly(cells)
        self.count += len(cells)

    def _extend_slowly(self, cells: list[str]) -> None:
        for k, cell in enumerate(cells):
            try:
                self.numbers.append(number(cell, self.table.decimal))
            except ValueError:
                raise self._wrong(
                    k, f"column {self.name!r}: found {cell.strip()[:40]!r}, expected a number"
                ) from None

    def _extend_dates(self, cells: list[str]) -> None:
        found = np.empty(len(cells), "datetime64[ns]")
        for k, cell in enumerate(cells):
            try:
                found[k] = date(cell) if cell.strip().lower() not in MISSING else np.datetime64("NaT")
            except ValueError:
                raise self._wrong(
                    k, f"column {self.name!r}: found {cell.strip()[:40]!r}, expected an ISO date"
                ) from None
        self.dates.append(found)

    def whole(self) -> Numbers:
        if self.dates:
            return np.concatenate(self.dates)
        return np.frombuffer(self.numbers, np.float64) if len(self.numbers) else np.zeros(0)

    def _wrong(self, row: int, text: str) -> InputError:
        return InputError(f"{self.table.path}:{self.table.line_of(self.count + row)}: {text}")


class _Numbered:
    """The lines of a file that may hold cells; knows the number of the last one."""

    def __init__(self, file: TextIO, before: int) -> None:
        self._file = file
        self.line = before

    def __iter__(self) -> Iterator[str]:
        for line in self._file:
            self.line += 1
            if line.strip() and not _is_comment(line):
                yield line


def _is_comment(line: str) -> bool:
    return line.lstrip(' \t\ufeff"').startswith(_COMMENT)


def _rows(lines: Iterator[str], separator: str) -> Iterator[list[str]]:
    if separator == " ":
        lines = (" ".join(line.split()) for line in lines)
    for row in csv.reader(lines, delimiter=separator, skipinitialspace=True):
        if any(cell.strip() for cell in row):
            yield row


def _separator(lines: list[str]) -> str:
    """The character that makes the most regular table of the most numbers out of the lines."""
    best, chosen = (-1.0, 0), ","
    for separator in _SEPARATORS:
        try:
            rows = list(_rows(iter(lines[-200:]), separator))
        except csv.Error:
            continue
        if not rows:
            continue
        later = rows[len(rows) // 2 :]
        width, regular = Counter(len(row) for row in later).most_common(1)[0]
        cells = [kind(cell) for row in later for cell in row]
        sound = sum(each != "t" for each in cells) / len(cells)
        # One column alone is no recording, if any other reading makes sense.
        score = (round(regular / len(later) * sound * (1.0 if width > 1 else _ALONE), 3), width)
        if score > best:
            best, chosen = score, separator
    return chosen


def _encoding(path: Path) -> str:
    """By the byte order mark; else UTF-16 where every second byte is 0, UTF-8 if it is, or Windows' own."""
    try:
        with open(path, "rb") as file:
            head = file.read(4096)
            for mark, name in _MARKS.items():
                if head.startswith(mark):
                    return name
            if len(head) > 3 and head[1:200:2].count(0) > 0.8 * len(head[1:200:2]):
                return "utf-16-le"
            if len(head) > 3 and head[0:200:2].count(0) > 0.8 * len(head[0:200:2]):
                return "utf-16-be"
            decoder = codecs.getincrementaldecoder("utf-8")()
            try:
                decoder.decode(head)
                while block := file.read(_BLOCK):
                    decoder.decode(block)
                decoder.decode(b"", final=True)
            except UnicodeDecodeError:
                return "cp1252"
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    return "utf-8"
