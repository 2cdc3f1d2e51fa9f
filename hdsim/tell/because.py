"""Why a verdict came about: the evidence for and against each effect, and the thresholds that were tested."""

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
    """How a rule is written: its text, the format of its values, on which side of its threshold it is met."""

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
        "share of the systematic residual that the identified effects explain together", _part
    ),
    "held-out data show the promised change": Wording(
        "share of its predicted change that held-out data confirm", _part
    ),
    "held-out data show all that was changed": Wording(
        "share of what all effects and the re-fit change together that held-out data confirm", _part
    ),
    "resampled records that it wins": Wording(
        "share of resampled records in which it, or its group, fits best", _part
    ),
    "a number stands at the end of its range": Wording(
        "one of its parameters is at a bound of its range", lambda _: "yes"
    ),
    "part of the structure in its own coordinate that it leaves": Wording(
        "residual over its own regressor, relative to that and what it explains", _part
    ),
    "one more effect": Wording("a further effect, not the first", lambda k: f"no. {k + 1:.0f}"),
    "part of what would be missing without it": Wording(
        "share of the other effects' residual that it explains", _part
    ),
    "structure is left by chance": Wording(
        "probability of as much systematic residual from noise alone (p-value)", below, "at most"
    ),
    "part of what is left that is structure": Wording("systematic share of the residual", _part, "at least"),
    "what is left, in units of the noise": Wording(
        "training residual of the worst channel, relative to its noise", times, "more than"
    ),
    "excess over the noise of a reading": Wording(
        "power of the worst training residual beyond the noise of a single reading", _part, "at least"
    ),
    "the re-fit closes a held-out gap": Wording(
        "reduction of a held-out residual by the re-fit", _part, "at least"
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
    """One piece of evidence for or against an effect: text, observed value, what it adds to the log odds."""

    words: str
    seen: str
    log_odds: float


@dataclass
class Weighing:
    """All the evidence on one effect.

    Attributes:
        name: key of the effect in the catalogue.
        weights: pieces of evidence in their order.
        probability: that the effect, or its group, is the right one; nan where it was not tested.
        needed: least probability of an effect that is identified.
        named: whether it is identified.
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
    """A rule with a threshold: text, observed value, the threshold as text, whether it is met."""

    words: str
    seen: str
    limit: str
    met: bool


def weighings(because: Sequence[Reason]) -> list[Weighing]:
    """The evidence on each effect, in the order in which they were found."""
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
    """Rules with thresholds that were applied to the diagnosis as a whole."""
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
