"""Cells of text tables: which are numbers, and where names, units and numbers stand."""

from __future__ import annotations

import datetime
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdsim.log.units import unit_of

#: What people and programs write where there is no number.
MISSING = frozenset({"", "-", "--", "---", "nan", "na", "n/a", "#n/a", "#nv", "null", "none", "nil", "."})
_FLAGS = {"true": 1.0, "false": 0.0}
_PLAIN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?(inf|infinity)", re.IGNORECASE)
#: Marks between groups of three digits that can be nothing else: apostrophes, and spaces of any kind.
_GROUPS = "'\u2019 \u00a0\u2009\u202f"
_GROUPED = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}([{_GROUPS}{other}])\d{{3}}(\1\d{{3}})*({re.escape(mark)}\d*)?")
    for mark, other in ((".", ","), (",", "."))
}
_DATE = re.compile(r"(\d{4}-\d\d-\d\d)(?:[T ](\d\d:\d\d(?::\d\d)?)(?:[.,](\d{1,9}))?(Z|[+-]\d\d:?\d\d)?)?")
_CLOCK = re.compile(r"(\d{1,2}:\d\d:\d\d)(?:[.,](\d{1,9}))?")
#: One mark, three digits after it and up to three before: 1,234 may be either.
_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")


def number(text: str, decimal: str) -> float:
    """The number that a cell's text means, NaN where it says that there is none.

    Args:
        text: the cell.
        decimal: the table's decimal mark, ``.`` or ``,``; the other one may group digits.

    Raises:
        ValueError: it is none.
    """
    text = text.strip().replace("\u2212", "-")
    lower = text.lower()
    if lower in MISSING:
        return float("nan")
    if lower in _FLAGS:
        return _FLAGS[lower]
    grouped = _GROUPED[decimal].fullmatch(text)
    if grouped:
        text = text.replace(grouped[1], "")
    plain = text if decimal == "." else text.replace(",", ".") if "." not in text else ""
    if not _PLAIN.fullmatch(plain):
        raise ValueError(text)
    return float(plain.lower().replace("d", "e"))


def date(text: str) -> np.datetime64:
    """A date, or a time of day (of 1970-01-01), in ISO 8601, to 1 ns.

    Raises:
        ValueError: it is neither.
    """
    text = text.strip()
    if clock := _CLOCK.fullmatch(text):
        day, of_day, fraction, zone = "1970-01-01", clock[1].zfill(8), clock[2], None
    elif whole := _DATE.fullmatch(text):
        day, of_day, fraction, zone = whole[1], whole[2] or "00:00", whole[3], whole[4]
    else:
        raise ValueError(text)
    found = datetime.datetime.fromisoformat(f"{day}T{of_day}{zone or 'Z'}")
    seconds = (found - datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC)) // datetime.timedelta(seconds=1)
    return np.datetime64(seconds * 1_000_000_000 + int((fraction or "0").ljust(9, "0")), "ns")


def kind(cell: Any) -> str:
    """``n`` for a number, ``d`` for a date, ``e`` for nothing, ``t`` for other text."""
    if cell is None:
        return "e"
    if isinstance(cell, bool | int | float):
        return "n"
    if isinstance(cell, datetime.datetime | datetime.time | datetime.date):
        return "d"
    text = str(cell)
    if text.strip().lower() in MISSING:
        return "e"
    for decimal in ".,":
        try:
            number(text, decimal)
        except ValueError:
            continue
        return "n"
    try:
        date(text)
    except ValueError:
        return "t"
    return "d"


def decimal_mark(cells: Sequence[str]) -> str | None:
    """The decimal mark of number cells; None where 1,234 may be either.

    A comma is one where a cell has a comma that cannot group thousands, or groups with points; else it is a
    point.
    """
    commas = [cell.strip() for cell in cells if "," in cell and kind(cell) == "n"]
    if not commas:
        return "."
    points = any(re.search(r"\d\.\d", cell) and "," not in cell for cell in cells if kind(cell) == "n")
    for cell in commas:
        if _EITHER.fullmatch(cell):
            continue
        try:
            number(cell, ",")
        except ValueError:
            return "."
        try:
            number(cell, ".")
        except ValueError:
            return ","
    if points or any(cell.count(",") > 1 for cell in commas):
        return "."
    return None


@dataclass(frozen=True)
class Layout:
    """Where what stands in a table.

    Args:
        names: names of the columns; "" where one has none.
        units: what stands in the row of units, by column.
        first: index of the first row of numbers among the rows looked at.
        words: columns whose cells there are words.
    """

    names: tuple[str, ...]
    units: dict[int, str]
    first: int
    words: tuple[int, ...]

    @property
    def headless(self) -> bool:
        """No row has names."""
        return not any(self.names)


def layout(rows: Sequence[Sequence[Any]], comments: Sequence[Sequence[str]] = ()) -> Layout | None:
    """Find names, units and numbers in the first rows of a table.

    Rows of numbers are told by their later ones: as many cells as most rows have, and no more text in it than
    there. The names stand right above, a row of units between the two.

    Args:
        rows: cells of the first rows, without comments and empty lines.
        comments: the comment lines above the numbers, split alike; the last may hold the names.

    Returns:
        None for no rows.
    """
    if not rows:
        return None
    counts = Counter(len(row) for row in rows)
    width = max(counts, key=lambda n: (counts[n], n))
    kinds = ["".join(kind(cell) for cell in row) for row in rows]
    later = [each for each in kinds[len(kinds) // 2 :] if len(each) == width] or kinds[-1:]
    most_text = max(each.count("t") for each in later)
    holding = [k for k, each in enumerate(kinds) if each.count("t") <= most_text and set(each) & {"n", "d"}]
    # Where no row of numbers is whole, the first that is not will be complained of.
    first = next((k for k in holding if len(kinds[k]) == width), min(holding, default=len(rows)))
    above = list(rows[:first])
    units: dict[int, str] = {}
    if len(above) >= 2 and _are_units(above[-1]) and _fits(above[-2], width):
        units = {k: _text(cell) for k, cell in enumerate(above.pop()) if _text(cell)}
    head: Sequence[Any] = ()
    if above and _fits(above[-1], width):
        head = above[-1]
    else:
        head = next((line for line in reversed(comments) if _fits(line, width)), ())
    names = [_text(cell) for cell in head][:width]
    words = tuple(k for k in range(width) if any(each[k : k + 1] == "t" for each in later))
    return Layout(tuple(names + [""] * (width - len(names))), units, first, words)


def _text(cell: Any) -> str:
    return "" if cell is None else " ".join(str(cell).split())


def _fits(row: Sequence[Any], width: int) -> bool:
    """A row that can name ``width`` columns: it may lack or have an empty last cell."""
    filled = len(row) - sum(1 for cell in row[width:] if not _text(cell))
    return (
        filled in (width, width - 1) and any(kind(cell) == "t" for cell in row) and (width > 1 or filled > 0)
    )


def _are_units(row: Sequence[Any]) -> bool:
    cells = [_text(cell) for cell in row if _text(cell) not in ("", "-", "[-]", "1")]
    known = sum(1 for cell in cells if unit_of(cell) is not None or re.fullmatch(r"[\[(].*[\])]", cell))
    return bool(cells) and 2 * known > len(cells)
