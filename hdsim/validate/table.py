"""All rows, in the order of the table: importing this imports the modules that register them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fnmatch import fnmatch
from pathlib import Path

from hdsim.errors import InputError
from hdsim.validate import machines, makers, motion
from hdsim.validate.rows import CHECKS, Row

#: The order of the table.
_PARTS = [part.__name__ for part in (motion, makers, machines)]


def names() -> list[str]:
    """Names of all rows."""
    return sorted(CHECKS, key=lambda name: _PARTS.index(CHECKS[name].__module__))


def compute(
    only: Iterable[str] = (), data: Path | None = None, on_row: Callable[[Row], object] | None = None
) -> list[Row]:
    """Compute the rows whose name matches a pattern (``orders-*``), or all.

    Args:
        only: patterns.
        data: folder with the measured records, laid out as docs/validation.md says; None for none.
        on_row: called with each row as soon as it is there.

    Raises:
        InputError: a pattern matches nothing, or the folder is none.
    """
    known, patterns = names(), list(only)
    for pattern in patterns:
        if not any(fnmatch(name, pattern) for name in known):
            raise InputError(f"no row is called {pattern!r}; there are: {', '.join(known)}")
    if data is not None and not data.is_dir():
        raise InputError(f"{data}: found no folder, expected the one with the measured records")
    wanted = [name for name in known if not patterns or any(fnmatch(name, p) for p in patterns)]
    rows: list[Row] = []
    for function in dict.fromkeys(CHECKS[name] for name in wanted):
        for row in function(data):
            if row.name in wanted:
                rows.append(row)
                if on_row is not None:
                    on_row(row)
    return sorted(rows, key=lambda row: wanted.index(row.name))
