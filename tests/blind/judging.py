"""What a diagnosis says of a blind case, and whether that is right."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import plants
from cases import Trial

import hdsim
from hdsim.diagnose.measured import Record
from hdsim.diagnose.workflow import Diagnosis, diagnose

BASE = Path(__file__).parent / "base.yaml"


@dataclass
class Outcome:
    """A verdict and the groups of names that it gives, in order."""

    verdict: str
    names: list[set[str]] = field(default_factory=list)

    @property
    def text(self) -> str:
        """In words."""
        return " + ".join([self.verdict, *("/".join(sorted(group)) for group in self.names)])


def run(trial: Trial) -> Diagnosis:
    """Diagnose a case. The truth stays here: only time and channels are handed over."""
    time, channels = plants.run(trial.case)
    scenario = hdsim.load_scenario(BASE)
    if trial.friction_free_base:
        friction = scenario.drive.friction.model_copy(update={"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0})
        scenario = scenario.model_copy(
            update={"drive": scenario.drive.model_copy(update={"friction": friction})}
        )
    return diagnose([Record("blind", time, channels)], scenario)


def outcome(trial: Trial) -> Outcome:
    """What is said of a case."""
    verdict = run(trial).verdict
    return Outcome(verdict.verdict, [{e.name, *e.indistinguishable_from} for e in verdict.effects])


def judge(trial: Trial, said: Outcome) -> bool:
    """Whether it is right: a group of at most three names counts when it holds the truth."""
    if trial.group == "null":
        return said.verdict in ("nothing", "parameter")
    if trial.group == "parameter":
        return said.verdict == "parameter"
    if trial.group == "outside":
        return said.verdict == "unknown"
    if trial.group == "faint":
        # Silence is allowed, a wrong name is not.
        return not said.names or _holds(said.names[0], trial.accepted[0])
    if not said.names:
        return False
    if trial.group == "pair":
        return all(any(_holds(group, wanted) for group in said.names) for wanted in trial.accepted)
    return _holds(said.names[0], trial.accepted[0])


def _holds(group: set[str], wanted: frozenset[str]) -> bool:
    return len(group) <= 3 and bool(group & wanted)
