"""All rows, in the paper's order: computing them imports the modules that register them."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatch

from hdsim.reproduce import backlash, drive, equations, identification, stiffness  # noqa: F401 - they register
from hdsim.reproduce.rows import CHECKS, Row
from hdsim.rows import chosen, made

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
    return made(CHECKS, chosen(names(), only, "nothing to reproduce"), lambda function: function())
