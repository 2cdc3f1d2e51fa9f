"""Why a verdict came about: its reasons in plain words, the weighing of each name apart from plain limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from hdsim.diagnosis.decide import Reason
from hdsim.tell.words import below, percent, short, started, times

Side = Literal["at least", "at most", "more than", ""]


@dataclass(frozen=True)
class Wording:
    """How a rule is told: its words, how its numbers are written, on which side of its limit it is met."""

    words: str
    shown: Callable[[float], str] = short
    side: Side = ""


def _part(share: float) -> str:
    """A share that may lie beyond 0 and 1."""
    if not math.isfinite(share) or 0.0 <= share <= 1.0:
        return percent(share)
    return f"{round(100 * share)}\u00a0%".replace("-", "−")


#: By the rule's own name, as ``decide`` has it.
WORDINGS = {
    "part of the structure that the names explain": Wording(
        "what the named effects explain together, of all that repeats", _part
    ),
    "held-out data show the promised change": Wording(
        "how much of the change that it promises shows in held-out data", _part
    ),
    "resampled records that it wins": Wording("resampled records in which it, or its group, is best", _part),
    "a number stands at the end of its range": Wording(
        "one of its numbers stands at the end of its range", lambda _: "yes"
    ),
    "part of the structure in its own coordinate that it leaves": Wording(
        "what it leaves in its own coordinate, of that and what it explains", _part
    ),
    "one more effect": Wording("not the first: a further effect", lambda k: f"no. {k + 1:.0f}"),
    "part of what would be missing without it": Wording(
        "part of what the other effects alone leave that it explains", _part
    ),
    "structure is left by chance": Wording(
        "chance that pure noise shows as much of a pattern as is left", below, "at most"
    ),
    "part of what is left that is structure": Wording(
        "part of what is left that is a pattern", _part, "at least"
    ),
    "what is left, in units of the noise": Wording(
        "what is left of the worst channel, in units of its noise", times, "more than"
    ),
    "the re-fit closes a held-out gap": Wording(
        "part of a held-out gap that the re-fitted numbers close", _part, "at least"
    ),
}
#: A rule that is not known here is told by its own name.
OTHERWISE = Wording("")


def wording(rule: str) -> Wording:
    """How a rule is told."""
    known = WORDINGS.get(rule, OTHERWISE)
    return known if known.words else Wording(rule)


@dataclass(frozen=True)
class Weight:
    """One piece of evidence for or against a name: words, what was seen, what it adds to the log odds."""

    words: str
    seen: str
    log_odds: float


@dataclass
class Weighing:
    """All that was weighed of one name.

    Attributes:
        name: of the effect, in the catalogue.
        weights: pieces of evidence in their order.
        probability: that the name, or its group, is right; nan where it was not asked.
        needed: least probability of a name that is given.
        named: whether it is.
    """

    name: str
    weights: list[Weight] = field(default_factory=list)
    probability: float = math.nan
    needed: float = math.nan
    named: bool = False

    @property
    def total(self) -> float:
        """Logarithm of the odds of its probability; nan where that is 0, 1 or unknown."""
        p = self.probability
        return math.log(p / (1.0 - p)) if 0.0 < p < 1.0 else math.nan

    @property
    def prior(self) -> float:
        """What the odds were before any of the evidence; nan where the total is."""
        return self.total - sum(weight.log_odds for weight in self.weights)


@dataclass(frozen=True)
class Condition:
    """A rule with a plain limit: words, what was seen, the limit in words, whether it is met."""

    words: str
    seen: str
    limit: str
    met: bool


def weighings(because: Sequence[Reason]) -> list[Weighing]:
    """What was weighed of each name, in the order in which they were found."""
    found: list[Weighing] = []
    rules: set[str] = set()
    open_ = list[Weighing]()
    for reason in because:
        if not reason.of:
            continue
        if reason.odds is None:
            own = next((one for one in open_ if one.name == reason.of), None)
            if own is None:
                own = Weighing(reason.of)
                found.append(own)
            else:
                open_.remove(own)
            own.probability, own.named = reason.seen, reason.holds
            own.needed = math.nan if reason.limit is None else reason.limit
            continue
        # A name may be found twice: its rules begin anew then.
        if not found or found[-1].name != reason.of or reason.rule in rules:
            found.append(Weighing(reason.of))
            open_.append(found[-1])
            rules = set()
        rules.add(reason.rule)
        said = wording(reason.rule)
        found[-1].weights.append(Weight(started(said.words), said.shown(reason.seen), reason.odds))
    return found


def conditions(because: Sequence[Reason]) -> list[Condition]:
    """Rules with plain limits that were asked of the whole."""
    return [_condition(reason) for reason in because if not reason.of]


def _condition(reason: Reason) -> Condition:
    said = wording(reason.rule)
    limit, met = "", reason.holds
    if reason.limit is not None:
        limit = f"{said.side} {said.shown(reason.limit)}".strip()
        # A reason holds where it speaks for the verdict; what is met is read off its own numbers.
        met = {
            "at least": reason.seen >= reason.limit,
            "at most": reason.seen <= reason.limit,
            "more than": reason.seen > reason.limit,
        }.get(said.side, reason.holds)
    return Condition(started(said.words), said.shown(reason.seen), limit, met)
