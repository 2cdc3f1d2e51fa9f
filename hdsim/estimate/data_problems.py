"""What a check of measured data finds: problems, and the noise of each channel."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

Severity = Literal["info", "warning", "error"]


@dataclass(frozen=True)
class Problem:
    """Something wrong or suspect.

    Attributes:
        record: name of the record.
        channel: name of the channel, or ``time``.
        kind: gap, missing, spikes, slips, dead, saturated, clock, unit, sign, ratio, side, drive, one way,
            zero, beginning, held out, jump, unsettled, resonance, search, motion.
        severity: an ``error`` stops a diagnosis.
        message: what was found, with the numbers that say so.
        count: samples concerned.
    """

    record: str
    channel: str
    kind: str
    severity: Severity
    message: str
    count: int = 0


@dataclass
class Check:
    """What a check found: problems, and the noise floor of each channel in its unit."""

    problems: list[Problem] = field(default_factory=list)
    noise: dict[str, float] = field(default_factory=dict)

    @property
    def errors(self) -> list[Problem]:
        """The problems that stop a diagnosis."""
        return [problem for problem in self.problems if problem.severity == "error"]
