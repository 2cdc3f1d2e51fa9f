"""A study from its plan to its results on disk."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.errors import InputError
from hdsim.studies.engine.execute import batches, execute, executor
from hdsim.studies.engine.journal import Journal, key_of
from hdsim.studies.engine.reading import Plan
from hdsim.studies.engine.table import StudyTable, study_table
from hdsim.studies.engine.worker import Job

if TYPE_CHECKING:
    from hdsim.studies.engine.worker import Row

#: Name of the file that grows while the study runs.
JOURNAL = "runs.jsonl"


@dataclass(frozen=True)
class StudyResult:
    """What a study came to.

    Args:
        plan: the study.
        table: one row a run.
        made: runs that were made now; the others were there already.
        seconds: wall time of those runs, summed over the workers.
    """

    plan: Plan
    table: StudyTable
    made: int
    seconds: float


def run_study(
    plan: Plan,
    folder: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    fresh: bool = False,
    on_progress: Callable[[int, int], object] | None = None,
) -> StudyResult:
    """Make the runs of a study that are not yet made, and put them all into a table.

    Args:
        plan: the study.
        folder: where the results are; a study that was killed goes on from there.
        workers: processes on this machine.
        scheduler: address of a Dask scheduler, used instead.
        fresh: forget what the folder holds.
        on_progress: called with the number of runs that are done and of all runs.

    Raises:
        InputError: the folder holds another study, or the executor cannot be had.
    """
    logs = str((folder / "logs").resolve()) if plan.study.keep_logs else None
    seconds = 0.0
    with Journal(folder / JOURNAL, key_of(plan.definition), fresh=fresh) as journal:
        before = len(journal.rows)
        missing = [Job(r.index, r.seed, r.values) for r in plan.runs if r.index not in journal.rows]

        def keep(rows: list[Row]) -> None:
            nonlocal seconds
            journal.add(rows)
            seconds += sum(row.seconds for row in rows)
            if on_progress is not None:
                on_progress(len(journal.rows), len(plan.runs))

        if on_progress is not None:
            on_progress(before, len(plan.runs))
        if missing:
            with executor(workers, scheduler) as (pool, width):
                names = [metric.name for metric in plan.metrics]
                execute(batches(plan.recipe, names, missing, width, logs), pool, width, keep)
        table = study_table(plan, journal.rows)
    return StudyResult(plan, table, len(missing), seconds)


def write_results(result: StudyResult, folder: Path) -> tuple[list[Path], list[str]]:
    """Write table (CSV, and Parquet where pyarrow is installed), summary, pictures and provenance.

    Returns:
        The files, and what could not be made of the runs and why.
    """
    from importlib.util import find_spec

    from hdsim.studies.engine.plots import study_figures
    from hdsim.studies.engine.sensitivity import Sensitivity, indices, is_sensitivity, write_indices
    from hdsim.studies.engine.summary import summarise, write_summary

    table, plan = result.table, result.plan
    written = [table.write_csv(folder / "results.csv")]
    if find_spec("pyarrow") is not None:
        written.append(table.write_parquet(folder / "results.parquet"))
    summaries = summarise(plan, table)
    written.append(write_summary(summaries, folder / "summary.csv", plan.study.confidence))
    about = folder / "provenance.json"
    about.write_text(json.dumps(table.provenance, indent=1) + "\n", encoding="utf-8")
    written.append(about)
    troubles: list[str] = []
    found: list[Sensitivity] = []
    if is_sensitivity(plan.study):
        try:
            found = indices(plan, table)
        except InputError as error:
            troubles.append(str(error))
        else:
            written.append(write_indices(found, folder / "sensitivity.csv"))
    for name, figure in study_figures(plan, table, summaries, found).items():
        path = folder / f"{name}.png"
        figure.savefig(path)
        written.append(path)
    return written, troubles
