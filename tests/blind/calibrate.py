"""Weights of ``hdsim.diagnosis.rules`` from stored cases: logistic regression of "the name is right".

Each effect that a search added is one example: what its evidence says (``decide.weighed``, at unit weights)
against whether it, or its group, is among the truth's. The prior of each weight is what stands in ``Rules``,
so that few cases move little; nothing here chooses a limit by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from judging import MOST_NAMES, Line, borne_out
from scipy.optimize import minimize

from hdsim.diagnosis.decide import decide, weighed
from hdsim.diagnosis.evidence import Evidence
from hdsim.diagnosis.rules import RULES, Rules

#: Weights that are fitted, in the order in which ``weighed`` uses them, and their prior's standard deviation.
WEIGHTS = (
    "odds",
    "explained",
    "held",
    "sampled",
    "own_left",
    "own_left_exact",
    "limit",
    "later",
    "needed",
)
SPREAD = 0.5
#: Those that can only speak against a name.
AGAINST = ("own_left", "own_left_exact", "limit", "later")


def examples(lines: Sequence[Line]) -> tuple[np.ndarray, np.ndarray]:
    """Evidence of every added effect at unit weights, shape (n, weights), and whether it is right, (n,)."""
    rows, right = [], []
    for line in lines:
        if not line.get("evidence"):
            continue
        evidence = Evidence.model_validate(line["evidence"])
        truth = {name for wanted in line["truth"] for name in wanted}
        for k, law in enumerate(evidence.laws):
            rows.append(_features(evidence, k))
            names = {law.name, *law.group}
            right.append(bool(names & truth) and len(names) <= MOST_NAMES)
    return np.array(rows), np.array(right, dtype=bool)


def _features(evidence: Evidence, k: int) -> list[float]:
    """What each weight multiplies: the change of the log odds by it."""

    def total(rules: Rules) -> float:
        return rules.odds + sum(weight for *_, weight in weighed(evidence, k, rules))

    none = RULES.model_copy(update=dict.fromkeys(WEIGHTS, 0.0))
    return [total(none.model_copy(update={name: 1.0})) - total(none) for name in WEIGHTS]


def fitted(x: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Weights of greatest posterior density, shape (weights,)."""
    prior = np.array([getattr(RULES, name) for name in WEIGHTS])
    sign = np.where(right, 1.0, -1.0)

    def loss(w: np.ndarray) -> float:
        return float(np.logaddexp(0.0, -sign * (x @ w)).sum() + 0.5 * np.sum(((w - prior) / SPREAD) ** 2))

    # What more is explained, won or shown can never speak against a name.
    lower = [None if name in ("odds", *AGAINST) else 0.0 for name in WEIGHTS]
    upper = [0.0 if name in AGAINST else None for name in WEIGHTS]
    return np.asarray(minimize(loss, prior, bounds=list(zip(lower, upper, strict=True))).x)


def calibrate(lines: Sequence[Line]) -> None:
    """Print the rules that these cases ask for, and what ``decide`` makes of them by either."""
    x, right = examples(lines)
    if not len(x):
        print("no case with evidence of an added effect")
        return
    weights = dict(zip(WEIGHTS, (round(float(w), 2) for w in fitted(x, right)), strict=True))
    found = RULES.model_copy(update=weights)
    print(f"{len(lines)} cases, {len(x)} added effects, {int(right.sum())} of them right")
    for name, value in weights.items():
        print(f"  {name}: {value:g} (now {getattr(RULES, name):g})")
    for title, rules in (("now", RULES), ("fitted", found)):
        judged = [judged_again(line, rules) for line in lines if line.get("evidence")]
        for kind in ("unknown", "nothing"):
            own = [borne_out(line) for line in judged if line["verdict"]["verdict"] in _ALIKE[kind]]
            print(f"{title}: {kind} right in {sum(own)} of {len(own)}")
        names = [line for line in judged if line["verdict"]["effects"]]
        print(f"{title}: first name right in {sum(map(borne_out, names))} of {len(names)}")


_ALIKE = {"unknown": ("unknown",), "nothing": ("nothing", "parameter")}


def judged_again(line: Line, rules: Rules) -> Line:
    """A stored case as ``decide`` judges it by these rules."""
    evidence = Evidence.model_validate(line["evidence"])
    decision = decide(evidence, rules)
    effects: list[dict[str, Any]] = [
        {
            "name": evidence.laws[k].name,
            "indistinguishable_from": evidence.laws[k].group,
            "confidence": decision.confidence[k],
            "parameters": {},
        }
        for k in decision.names
    ]
    verdict = dict(line["verdict"] or {}) | {
        "verdict": decision.kind, "effects": effects, "confidence": decision.certainty,
    }  # fmt: skip
    return line | {"verdict": verdict}
