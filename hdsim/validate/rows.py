"""A row of the table: what the world says, what hdsim computes, and how far they are apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from hdsim.rows import registrar


class Verdict(StrEnum):
    """How a row fares."""

    HOLDS = "holds"
    FAILS = "FAILS"
    ABSENT = "data absent"


@dataclass(frozen=True)
class Row:
    """One quantity that somebody else printed, measured or computed.

    Args:
        name: short name, for ``--only``.
        quantity: what it is, in words.
        unit: of both values; ``1`` for a pure number.
        source: who says so, and where.
        stated: value of the source.
        computed: value of hdsim; NaN without data.
        tolerance: allowed deviation, in the unit unless ``relative``.
        because: where the tolerance comes from.
        relative: whether the tolerance is a share of the stated value.
        limit: whether the stated value is an upper limit; the tolerance is 0 then.
        fitted: whether the stated value set a number of the model: such a row only shows that the assembled
            model gives it back.
        remark: what else is to be said; for a row that fails, why.
    """

    name: str
    quantity: str
    unit: str
    source: str
    stated: float
    computed: float
    tolerance: float
    because: str
    relative: bool = True
    limit: bool = False
    fitted: bool = False
    remark: str = ""

    @property
    def deviation(self) -> float:
        """Computed less stated, in the unit, or as a share of the stated value."""
        difference = self.computed - self.stated
        return difference / self.stated if self.relative else difference

    @property
    def verdict(self) -> Verdict:
        """Whether the deviation is within the tolerance."""
        if math.isnan(self.computed):
            return Verdict.ABSENT
        inside = self.deviation <= 0.0 if self.limit else abs(self.deviation) <= self.tolerance
        return Verdict.HOLDS if inside else Verdict.FAILS


#: Makes rows; given the folder with the measured data, or None.
Check = Callable[[Path | None], Iterable[Row]]

#: What makes a row, by its name, in the order of the table.
CHECKS: dict[str, Check] = {}

check = registrar(CHECKS)
