"""All rows, in the order of the table: importing this imports the modules that register them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from hdsim.errors import InputError
from hdsim.rows import chosen, made
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
    wanted = chosen(names(), only, "no row")
    if data is not None and not data.is_dir():
        raise InputError(f"{data}: found no folder, expected the one with the measured records")
    return made(CHECKS, wanted, lambda function: function(data), on_row)
