"""A row of the reproduction: what the paper says, what hdsim computes, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from fnmatch import fnmatch

from hdsim.errors import InputError


class Verdict(StrEnum):
    """How the paper fares."""

    REPRODUCED = "reproduced"
    CONTRADICTED = "contradicted"
    OPEN = "not determined by the paper"


@dataclass(frozen=True)
class Row:
    """One statement of the paper.

    Args:
        name: short name, for ``--only``.
        source: equation, table, figure or section.
        statement: what is claimed, in words.
        paper: what the paper prints.
        computed: what comes out, with spread.
        verdict: the judgement.
        reason: why.
        correction: the corrected equation or text, if there is one.
        values: the numbers behind ``computed``, SI units, for JSON.
    """

    name: str
    source: str
    statement: str
    paper: str
    computed: str
    verdict: Verdict
    reason: str
    correction: str = ""
    values: dict[str, float] = field(default_factory=dict)


Check = Callable[[], Iterable[Row]]

_CHECKS: dict[str, Check] = {}

#: The paper's order, as patterns of names.
_ORDER = (
    "eq-[1-9]", "eq-1[0-8]", "round-trip-*", "resolution", "equivalent-pair", "table-4-*", "fig-[89]",
    "rule-*", "fig-1*", "eq-21", "stiffness-*", "boundary-element", "drive-*",
)  # fmt: skip


def check(*names: str) -> Callable[[Check], Check]:
    """Register a function that makes the rows of these names."""

    def register(function: Check) -> Check:
        for name in names:
            _CHECKS[name] = function
        return function

    return register


def names() -> list[str]:
    """Names of all rows, in the paper's order."""
    from hdsim.reproduce import backlash, drive, equations, identification, stiffness  # noqa: F401

    return sorted(_CHECKS, key=_place)


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
    for function in dict.fromkeys(_CHECKS[name] for name in wanted):
        rows += [row for row in function() if row.name in wanted]
    return sorted(rows, key=lambda row: wanted.index(row.name))
