"""Write the results of a diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.diagnosis.following import next_experiment
from hdsim.diagnosis.teeth import toothed_changes
from hdsim.estimate.write import scenario_text
from hdsim.scenario.writer import to_yaml
from hdsim.tell.findings import Findings, gather
from hdsim.tell.record_out import write_compared
from hdsim.tell.report import write_report
from hdsim.tell.staging import staged
from hdsim.tell.words import title_of

if TYPE_CHECKING:
    from hdsim.diagnosis.workflow import Diagnosis

#: Name of the scenario of a drive whose teeth have the play that was found.
TOOTHED = "with teeth that have the play that was found"
#: The scenario with the curve of what identified effects leave: its file, what it is called, what it says.
WITH_CURVE = "found_with_curve.yaml"
CURVED = (
    "with what was found and a curve",
    "Written by a diagnosis: the base with parameters estimated from measured data, effects, and a curve.",
)


def save(diagnosis: Diagnosis, base: str | Path, out: str | Path, found: Findings | None = None) -> Path:
    """Write ``verdict.json``, ``evidence.json``, scenario, figures, log, report; returns the report's path.

    Args:
        diagnosis: what was found.
        base: file of the base scenario.
        out: directory; made when it is not there. Nothing is left in it when a file cannot be written.
        found: what `gather` makes of the diagnosis, where it is at hand.

    Raises:
        InputError: ``out`` cannot be written.
    """
    out = Path(out)
    verdict = diagnosis.verdict
    with staged(out) as stage:
        # What an earlier diagnosis found must not stay beside this one's verdict.
        for name in ("found.yaml", WITH_CURVE, "next.yaml", "toothed.yaml", "curve.png"):
            (out / name).unlink(missing_ok=True)
        if verdict.verdict in ("effect", "parameter") or verdict.curve is not None:
            state, freedoms = diagnosis.final.state, diagnosis.refit.freedoms
            text = scenario_text(Path(base).resolve(), state, freedoms, diagnosis.start, out.resolve())
            (stage / "found.yaml").write_text(text, encoding="utf-8")
            verdict.scenario = str(out / "found.yaml")
            if diagnosis.with_curve is not None:
                also = diagnosis.with_curve.state
                text = scenario_text(
                    Path(base).resolve(), also, freedoms, diagnosis.start, out.resolve(), CURVED
                )
                (stage / WITH_CURVE).write_text(text, encoding="utf-8")
                verdict.scenario_with_curve = str(out / WITH_CURVE)
            changes = toothed_changes(verdict.effects, diagnosis.final.state)
            if changes is not None and verdict.teeth is not None:
                head = {"name": TOOTHED, "extends": "found.yaml"}
                (stage / "toothed.yaml").write_text(to_yaml(head | changes), encoding="utf-8")
                verdict.teeth.scenario = str(out / "toothed.yaml")
        experiment = next_experiment(diagnosis, Path(base), out, title_of)
        if experiment is not None:
            (stage / "next.yaml").write_text(experiment, encoding="utf-8")
        write_compared(diagnosis, stage)
        (stage / "verdict.json").write_text(verdict.model_dump_json(indent=2), encoding="utf-8")
        evidence = diagnosis.evidence.model_dump_json(indent=2)
        (stage / "evidence.json").write_text(evidence, encoding="utf-8")
        report = write_report(found or gather(diagnosis), stage)
    return out / report.name
