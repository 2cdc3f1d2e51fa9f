"""What a reader of a format gives: columns of a table, or messages of topics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError

#: float64, or datetime64[ns] where a recording holds dates.
Numbers = NDArray[Any]
Tell = Callable[[float], object]
"""Takes the share that has been read, 0 to 1."""

Message = tuple[str, int, int, Callable[[], Any]]
"""Topic, log time and publish time in ns, and what decodes the body."""


def silent(share: float) -> None:
    """Tell nobody."""


class Table(ABC):
    """An open file of columns.

    Args:
        path: the file.
        names: names of its columns, in their order; "" where one has none.
        units: units that the file states beside a name, by the column's place.
        notes: what was found out about the file's form, for a reader to check.
        words: places of columns that hold words instead of numbers, as far as is known.
    """

    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        units: dict[int, str] | None = None,
        notes: Sequence[str] = (),
        words: Iterable[int] = (),
    ) -> None:
        self.path = path
        self.names = tuple(names)
        self.units = units or {}
        self.notes = tuple(notes)
        self.words = frozenset(words)

    @abstractmethod
    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        """Columns (n,) at these places; NaN where the file has nothing.

        Args:
            places: from 0.
            rows: only the first ones, or all of them.
            tell: hears how far the reading is.

        Raises:
            InputError: a cell is no number, or the file is damaged.
        """

    def place(self, column: str | int) -> int:
        """Place of a column, from 0, by its name or by its number, from 1.

        Raises:
            InputError: there is none, or more than one of that name.
        """
        if isinstance(column, int):
            if not 1 <= column <= len(self.names):
                raise InputError(f"{self.path}: no column {column}; it has {len(self.names)}")
            return column - 1
        found = [place for place, name in enumerate(self.names) if name == column]
        if not found:
            raise missing(self.path, "column", column, [name for name in self.names if name])
        if len(found) > 1:
            numbers = ", ".join(str(place + 1) for place in found)
            raise InputError(
                f"{self.path}: {len(found)} columns are called {column!r}: name one by its number ({numbers})"
            )
        return found[0]


def missing(path: Path | str, what: str, name: str, there: Iterable[str]) -> InputError:
    """The error for a name that is not in the file, with the nearest that are."""
    known = list(there)
    near = get_close_matches(name, known, 3, 0.5)
    lower = [k for k in known if k.lower() == name.lower()]
    listed = ", ".join(lower or near) or ", ".join(known[:12]) + (" ..." if len(known) > 12 else "")
    return InputError(f"{path}: no {what} {name!r}; {'nearest' if near or lower else 'there are'}: {listed}")


def needed(package: str, module: str, extra: str, what: str) -> Any:
    """An optional package.

    Raises:
        InputError: it is not installed; names the extra that brings it.
    """
    try:
        return import_module(module)
    except ImportError:
        raise InputError(
            f"reading {what} needs the package {package}: pip install 'hdsim[{extra}]'"
        ) from None


def numeric(values: Any, path: Path, name: str) -> Numbers:
    """A column of a binary file as float64 or datetime64[ns], shape (n,).

    Raises:
        InputError: it holds neither numbers nor dates.
    """
    found = np.asarray(values).reshape(-1)
    if found.dtype.kind == "M":
        return found.astype("datetime64[ns]")
    if found.dtype.kind not in "biuf":
        raise InputError(f"{path}: column {name!r} holds {found.dtype}, expected numbers")
    return found.astype(np.float64)


def even(path: Path, columns: Sequence[Numbers], names: Sequence[str]) -> None:
    """Check that columns belong together.

    Raises:
        InputError: they are of different lengths.
    """
    for name, column in zip(names, columns, strict=True):
        if len(column) != len(columns[0]):
            raise InputError(
                f"{path}: {names[0]!r} has {len(columns[0])} samples, {name!r} {len(column)}: "
                f"map channels of one rate"
            )
