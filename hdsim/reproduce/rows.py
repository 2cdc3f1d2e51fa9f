"""A row of the reproduction: what the paper says, what hdsim computes, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum

from hdsim.rows import registrar


class Verdict(StrEnum):
    """How the paper fares; ``DEFINITIONS`` says what each means."""

    REPRODUCED = "reproduced"
    CHOICE = "reproduced with a stated choice"
    CONTRADICTED = "contradicted"
    OPEN = "not determined by the paper"


DEFINITIONS: dict[Verdict, str] = {
    Verdict.REPRODUCED: "what the paper prints follows from its equations and numbers, and nothing was "
    "chosen that could turn it",
    Verdict.CHOICE: "it follows once something is fixed that the paper does not state: every such choice "
    "stands beside it, with what its other values give",
    Verdict.CONTRADICTED: "the paper's own equations and numbers give something else, whatever plausible "
    "value is taken for what it does not state; the corrected equation or text stands beside it",
    Verdict.OPEN: "a value or a definition is missing, and what comes out depends on it",
}


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
        choices: what was fixed here that the paper does not state, and what comes out at other values.
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
    choices: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.verdict == Verdict.CHOICE and not self.choices:
            raise ValueError(f"{self.name}: reproduced with a stated choice, but none is stated")


Check = Callable[[], Iterable[Row]]

#: What makes a row, by its name.
CHECKS: dict[str, Check] = {}

check = registrar(CHECKS)
