"""Findings written by hand: what a verdict of each kind rests on, decided by the program's own rules."""

from pathlib import Path

from hdsim.diagnosis.decide import decide
from hdsim.diagnosis.evidence import (
    CandidateEvidence,
    Evidence,
    HeldOutEvidence,
    LawEvidence,
    PlaceEvidence,
    RestEvidence,
    StageEvidence,
)
from hdsim.diagnosis.verdict import IdentifiedEffect, Verdict
from hdsim.estimate.found import Gap
from hdsim.tell.findings import Findings
from hdsim.tell.report import write_report

#: A record's name that must not end as HTML.
NASTY = "<script>alert('x')</script> & co"
GAP = Gap(before=0.02, refit=0.015, after=0.0021, noise=0.002, unit="N m", variation=0.1, regression=0.0032)


def place(coordinate: str = "output_angle", share: float = 0.8) -> PlaceEvidence:
    return PlaceEvidence(coordinate=coordinate, channel="motor_torque", share=share, power=share)


def stage(structured: float, chance: float, **changes) -> StageEvidence:
    return StageEvidence(
        title="refit", power=1e4, structured=structured, structured_chance=chance, places=[place()], **changes
    )


def law(name: str = "motor_torque_ripple", **changes) -> LawEvidence:
    return LawEvidence(name=name, **({"chance": 0.0025, "sampled": 0.97, "gain": 0.9} | changes))


def rest(times_noise: float) -> RestEvidence:
    return RestEvidence(record="a.csv", channel="motor_torque", times_noise=times_noise)


def candidate(name: str, explained: float) -> CandidateEvidence:
    return CandidateEvidence(name=name, screened=0.5, explained=explained, numbers=2)


#: Evidence that is clear for each verdict.
EFFECT = Evidence(
    stages=[stage(0.9, 0.0025), stage(0.01, 0.6)],
    laws=[law()],
    explained=0.97,
    left=0.01,
    left_chance=0.6,
    held=HeldOutEvidence(slope=0.98, spread=0.02),
    rest=rest(1.05),
)
#: The law explains 86 % only and held-out data show half of what it promises.
UNKNOWN = Evidence(
    stages=[stage(0.9, 0.0025), stage(0.4, 0.0025)],
    laws=[law("stribeck_friction", sampled=0.5, at_limit=True)],
    explained=0.86,
    left=0.4,
    left_chance=0.0025,
    held=HeldOutEvidence(slope=0.4, spread=0.1),
    rest=rest(3.0),
)
NOTHING = Evidence(stages=[stage(0.01, 0.6)], left=0.01, left_chance=0.6, rest=rest(1.02))
PARAMETER = NOTHING.model_copy(update={"fell": 0.4})
KINDS = {"effect": EFFECT, "unknown": UNKNOWN, "nothing": NOTHING, "parameter": PARAMETER}


def told(evidence: Evidence, **changes) -> Findings:
    """Findings as the workflow makes them of the evidence."""
    decision = decide(evidence)
    effects = [
        IdentifiedEffect(
            name=evidence.laws[k].name,
            title=evidence.laws[k].name.replace("_", " "),
            confidence=decision.confidence[k],
            chance=evidence.laws[k].chance,
            explained=0.9,
            indistinguishable_from=evidence.laws[k].group,
        )
        for k in decision.names
    ]
    fields = {
        "verdict": decision.kind, "sentence": "As the workflow says it.", "effects": effects,
        "because": decision.because, "gap": {"motor_torque": GAP},
    }  # fmt: skip
    return Findings(Verdict(**(fields | changes)), evidence)


def page(found: Findings, folder: Path) -> str:
    """The report's text."""
    return write_report(found, folder).read_text(encoding="utf-8")
