"""What to measure next: the candidates that a diagnosis leaves open, and what tells them apart."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from hdsim.diagnosis.experiment import TELLS, propose
from hdsim.diagnosis.workflow import Diagnosis
from hdsim.errors import InputError
from hdsim.estimate.fit import Fit, settled

#: Probability to be right below which a name is weak: then it is held against the model without it.
WEAK = 0.8
#: Name of the model without an effect among the candidates.
NOTHING = "nothing more"


def candidates(diagnosis: Diagnosis) -> dict[str, Fit]:
    """Fitted models that these data leave open, the best first; empty when they leave nothing open.

    A group of effects that cannot be told apart comes before a weak name. All fits are those made when the
    effect was named, so that they know the same other effects.
    """
    if diagnosis.verdict.verdict != "effect" or diagnosis.start.load.arm is not None:
        return {}
    bench = diagnosis.bench
    for one in diagnosis.named:
        others = {name: one.alternatives[name] for name in one.group if name in one.alternatives}
        if others:
            return {name: settled(bench, each) for name, each in {one.name: one.fit, **others}.items()}
    last = diagnosis.named[-1]
    if diagnosis.verdict.effects[-1].confidence < WEAK and len(diagnosis.named) == 1:
        return {last.name: settled(bench, last.fit), NOTHING: diagnosis.refit.fit}
    return {}


def next_experiment(
    diagnosis: Diagnosis, base: Path, out: Path, title_of: Callable[[str], str], name: str = "next.yaml"
) -> str | None:
    """Set the verdict's ``next_experiment``, where something is left open.

    Args:
        diagnosis: what was found.
        base: file of the base scenario.
        out: directory in which the experiment's scenario will stand.
        title_of: words for a candidate: an effect's name, or ``NOTHING``.
        name: the scenario's file name.

    Returns:
        The YAML text of the experiment's scenario.
    """
    found = candidates(diagnosis)
    if len(found) < 2:
        return None
    started = time.perf_counter()
    titles = {key: title_of(key) for key in found}
    try:
        proposal, text = propose(
            diagnosis.bench, found, base=base.resolve(), beside=out.resolve(), titles=titles
        )
    except InputError:
        return None  # no experiment could be simulated: that is no reason to lose the verdict
    tells = proposal.separation >= TELLS
    proposal.scenario = str(out / name) if tells else None
    diagnosis.verdict.next_experiment = proposal
    diagnosis.verdict.seconds["next"] = round(time.perf_counter() - started, 3)
    return text if tells else None
