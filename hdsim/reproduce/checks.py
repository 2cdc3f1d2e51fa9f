"""All rows, in the paper's order: computing them imports the modules that register them."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatch

from hdsim.errors import InputError
from hdsim.reproduce import backlash, drive, equations, identification, stiffness  # noqa: F401 - they register
from hdsim.reproduce.rows import CHECKS, Row

#: The paper's order, as patterns of names.
_ORDER = (
    "eq-[1-9]", "eq-1[0-8]", "round-trip-*", "resolution", "equivalent-pair", "table-4-*", "fig-[89]",
    "rule-*", "fig-1*", "eq-21", "stiffness-*", "boundary-element", "drive-*",
)  # fmt: skip


def names() -> list[str]:
    """Names of all rows, in the paper's order."""
    return sorted(CHECKS, key=_place)


def _place(name: str) -> int:
    return next(k for k, pattern in enumerate(_ORDER) if fnmatch(name, pattern))


def compute(only: Iterable[str] = ()) -> list[Row]:
    """Compute the rows whose name matches a pattern (``eq-*``, ``table-4*``), or all.

    Raises:
        InputError: when a pattern matches nothing.
    """
    known = names()
    patterns = list(only)
    for pattern in patterns:
        if not any(fnmatch(name, pattern) for name in known):
            raise InputError(f"nothing to reproduce is called {pattern!r}; there are: {', '.join(known)}")
    wanted = [n for n in known if not patterns or any(fnmatch(n, p) for p in patterns)]
    rows: list[Row] = []
    for function in dict.fromkeys(CHECKS[name] for name in wanted):
        rows += [row for row in function() if row.name in wanted]
    return sorted(rows, key=lambda row: wanted.index(row.name))
