"""Names that are not believed are taken back, and what the identified effects leave."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from hdsim.diagnosis.again import located
from hdsim.diagnosis.evidence import Evidence
from hdsim.diagnosis.passes import Search
from hdsim.diagnosis.revise import revised
from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.verdict import Remains
from hdsim.estimate.asked import gone_with
from hdsim.estimate.bench import Bench
from hdsim.estimate.refit import together

#: Least part of the structure that is said to follow another shape than its law's.
LEAST_REST = 0.02


def taken_back(bench: Bench, found: Search, k: int, tell: Callable[[str], object]) -> Search:
    """A search's result without one of its names, the rest fitted and asked anew.

    What is said of the others beside a name that is not believed does not hold for the model that is left: of
    two that take each other's place neither seems needed.

    Args:
        bench: the measured series.
        found: the search's result, with several names.
        k: which of them.
        tell: told what is being done.
    """
    named = [replace(one) for j, one in enumerate(found.named) if j != k]
    fit = together(bench, gone_with(found.fit, k))
    fit = revised(bench, fit, named, tell)
    left, location = located(bench, fit)
    last = replace(found.stages[-1], location=location, power=left.power)
    return Search(fit, left, [*found.stages[:-1], last], named, ended=found.ended, sensitive=found.sensitive)


def remains(evidence: Evidence) -> Remains | None:
    """What the identified effects leave; None where it may be chance or is too little to say."""
    places = evidence.stages[-1].places if evidence.stages else []
    left = 1.0 - evidence.explained
    if evidence.left_chance > RULES.chance or left < LEAST_REST or not places:
        return None
    return Remains(share=left, coordinate=places[0].coordinate)
