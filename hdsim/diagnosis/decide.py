"""The verdict from the evidence: a pure function of it and of the rules.

Every name is a hypothesis whose log odds of being right are the sum of what each piece of evidence says
(Good 1950, Probability and the Weighing of Evidence); a name is given where it is more likely right than the
rules ask. Where something is there and no name is, it is ``unknown``.
"""

from __future__ import annotations

import math
from typing import Literal

from hdsim.diagnosis.evidence import Evidence, HeldOutEvidence
from hdsim.diagnosis.rules import RULES, Rules
from hdsim.estimate.found import Part

#: Standard errors by which a slope must be below a half for held-out data to be predicted worse for certain.
WORSE = 2.0

Kind = Literal["nothing", "parameter", "effect", "unknown"]


class Reason(Part):
    """One rule with what was seen."""

    rule: str
    """What is asked."""
    of: str = ""
    """Of which effect; empty: of the whole."""
    seen: float
    """What was seen."""
    limit: float | None = None
    """The rule's number, where it is a limit."""
    odds: float | None = None
    """What it adds to the logarithm of the odds, where it weighs."""
    holds: bool
    """Whether it speaks for the verdict."""


class Decision(Part):
    """What the evidence amounts to."""

    kind: Kind
    """The verdict."""
    names: list[int] = []
    """Which of the evidence's effects are believed."""
    confidence: list[float] = []
    """Probability that each of the evidence's effects is right, itself or its group."""
    certainty: float
    """Probability that the verdict is right: its first name's, or that of there being none to give."""
    because: list[Reason] = []
    """Every rule that was asked, with what was seen."""


def decide(evidence: Evidence, rules: Rules = RULES) -> Decision:
    """What the evidence amounts to.

    Args:
        evidence: all that was found out.
        rules: the numbers by which it is weighed.
    """
    because: list[Reason] = []
    confidence = [probability(evidence, k, rules, because) for k in range(len(evidence.laws))]
    names = [k for k, p in enumerate(confidence) if p >= rules.believed]
    because += [_likely(evidence, k, p, rules) for k, p in enumerate(confidence)]
    if names:
        return Decision(
            kind="effect",
            names=names,
            confidence=confidence,
            certainty=confidence[names[0]],
            because=because,
        )
    # An effect that is not believed tells of nothing by itself: what was there without it is asked.
    left, rest, chance = evidence.left, evidence.rest, evidence.left_chance
    if evidence.laws:
        left, rest, chance = evidence.patterned, evidence.rest_before, evidence.pattern_chance
    structured = chance <= rules.chance or bool(evidence.laws)
    because.append(
        Reason(rule="structure is left by chance", seen=chance, limit=rules.chance, holds=structured)
    )
    structured = structured and left >= rules.structured
    times = rest.times_noise if rest is not None else 0.0
    for rule, seen, limit, holds in (
        ("part of what is left that is structure", left, rules.structured, structured),
        ("what is left, in units of the noise", times, rules.rest, times > rules.rest),
    ):
        because.append(Reason(rule=rule, seen=seen, limit=limit, holds=holds))
    if rest is not None:
        # Means of many readings show structure that is less than what counts as an effect.
        excess = times**2 - 1.0
        counts = excess >= rules.excess
        structured = structured and counts
        rule = "excess over the noise of a reading"
        because.append(Reason(rule=rule, seen=excess, limit=rules.excess, holds=counts))
    if structured or times > rules.rest:
        certainty = (1.0 - max(confidence, default=0.0)) * rules.unknown
        return Decision(kind="unknown", confidence=confidence, certainty=certainty, because=because)
    fell = evidence.fell >= rules.fall
    because.append(
        Reason(rule="the re-fit closes a held-out gap", seen=evidence.fell, limit=rules.fall, holds=fell)
    )
    kind: Kind = "parameter" if fell else "nothing"
    return Decision(kind=kind, confidence=confidence, certainty=rules.nothing, because=because)


def reasons_of(evidence: Evidence, k: int, rules: Rules = RULES) -> list[Reason]:
    """Every rule that was asked of one effect of the evidence, with what was seen."""
    because: list[Reason] = []
    p = probability(evidence, k, rules, because)
    return [*because, _likely(evidence, k, p, rules)]


def _likely(evidence: Evidence, k: int, p: float, rules: Rules) -> Reason:
    enough, name = p >= rules.believed, evidence.laws[k].name
    return Reason(rule="likely enough for a name", of=name, seen=p, limit=rules.believed, holds=enough)


def probability(evidence: Evidence, k: int, rules: Rules, because: list[Reason]) -> float:
    """Probability that an effect of the evidence, or its group, is right.

    Args:
        evidence: all that was found out.
        k: which effect.
        rules: the weights.
        because: reasons are appended.
    """
    total = rules.odds
    for name, seen, weight in weighed(evidence, k, rules):
        total += weight
        because.append(Reason(rule=name, of=evidence.laws[k].name, seen=seen, odds=weight, holds=weight >= 0))
    return 1.0 / (1.0 + math.exp(-total))


def weighed(evidence: Evidence, k: int, rules: Rules) -> list[tuple[str, float, float]]:
    """Each piece of evidence on an effect: what it is, what was seen, its weight in log odds."""
    law = evidence.laws[k]
    # Each is asked what held-out data show of its own. A later one that is no line is bent to what is left,
    # and so to much of what is left elsewhere: for it they speak where all of them show it alike.
    held_out = law.held if law.held is not None else evidence.held
    held = rules.held * _held(held_out, rules)
    # A sharp line that data hold which no step has seen is none that the search has chosen of many.
    line = law.sharp and _repeats(held_out, rules.repeats, rules)
    repeats = line and law.held is not None
    # A law that is bent to what is another's is there in some blocks of time, in others not.
    steady = law.held is not None and _repeats(held_out, rules.steady, rules)
    # What is left elsewhere than in its own coordinate is another effect's, and counts half; whole where all
    # names together explain less than they leave: they may well be bent to a part of what has no name.
    seen = _log_odds(evidence.explained)
    if evidence.explained >= rules.explained_most or line:
        seen = 0.5 * (seen + _log_odds(1.0 - law.own_left))
    explained = rules.explained * (seen - _log_odds(rules.explained_even))
    found = [
        # What all explain together speaks for the first; of a later one it only says that all are too little.
        (
            "part of the structure that the names explain",
            evidence.explained,
            min(explained, 0.0) if k else explained,
        ),
        (
            "held-out data show the promised change",
            held_out.slope,
            min(held, 0.0) if k and not (repeats or steady) else held,
        ),
        ("resampled records that it wins", law.sampled, rules.sampled * _log_odds(law.sampled)),
    ]
    # Beside numbers that a re-fit has bent the wrong way an effect may only take back what these did.
    changed = _held(evidence.changed, rules)
    if changed < 0.0:
        found.append(("held-out data show all that was changed", evidence.changed.slope, changed))
    left = law.own_left
    if law.exact and law.own_first and law.own_left > rules.exactly:
        left = evidence.left if evidence.left_chance <= rules.chance else 0.0
    found.append(
        (
            "part of the structure in its own coordinate that it leaves",
            left,
            (rules.own_left_exact if law.exact else rules.own_left) * left,
        )
    )
    if law.at_limit:
        found.append(("a number stands at the end of its range", 1.0, rules.limit))
    if k > 0:
        if not repeats:
            found.append(("one more effect", float(k), rules.later))
        found.append(
            ("part of what would be missing without it", law.needed, rules.needed * _log_odds(law.needed))
        )
    return found


def _repeats(held: HeldOutEvidence, times: float, rules: Rules) -> bool:
    """Whether held-out data show nearly all of a change by itself, ``times`` its standard error."""
    return held.slope > 1.0 - rules.held_mismatch and held.slope > times * held.spread


def _held(held: HeldOutEvidence, rules: Rules) -> float:
    """Log odds of "all of the promised change is there" against "none is", by its held-out slope.

    Below a half the effect makes the residual of held-out data larger: where that is no chance (two standard
    errors), it is all against it.
    """
    if held.slope + WORSE * held.spread < 0.5:
        return -rules.held_against
    variance = held.spread**2 + rules.held_mismatch**2
    odds = (2.0 * held.slope - 1.0) / (2.0 * variance)
    return float(min(max(odds, -rules.held_against), rules.held_for))


def _log_odds(part: float, least: float = 0.02) -> float:
    part = min(max(part, least), 1.0 - least)
    return math.log(part / (1.0 - part))
