"""A row of the reproduction: what the paper says, what hdsim computes, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum


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

#: What makes a row, by its name.
CHECKS: dict[str, Check] = {}


def check(*names: str) -> Callable[[Check], Check]:
    """Register a function that makes the rows of these names."""

    def register(function: Check) -> Check:
        for name in names:
            CHECKS[name] = function
        return function

    return register
