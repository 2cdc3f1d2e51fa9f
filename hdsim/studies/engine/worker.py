"""What happens on a worker: a batch of runs in, a row for each out. Everything that goes in
can be pickled.
"""

from __future__ import annotations

import copy
import json
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdsim.errors import HdsimError, InputError
from hdsim.scenario.names import choices_first, set_value

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario.model import Scenario

#: Parameters that change what the base is made from; they are set before all others.
PRESET = "drive.preset"
OPTIONS = "options."


@dataclass(frozen=True)
class Recipe:
    """How to make the scenario of a run.

    Args:
        base: the study's base as JSON: ``scenario`` (complete), or ``procedure`` with its arguments.
        written: the base's drive and effects as the user wrote them, as JSON, for another preset.
        names: the study's parameters, in the order of every run's values.
    """

    base: str
    written: str
    names: tuple[str, ...]

    def data(self, values: Sequence[Any]) -> dict[str, Any]:
        """The scenario of a run as plain data, seed not yet set.

        Raises:
            InputError: the procedure refuses its options.
        """
        given = dict(zip(self.names, values, strict=True))
        remade = {name: v for name, v in given.items() if remakes_base(name)}
        data: dict[str, Any] = copy.deepcopy(
            _base(self.base, self.written, json.dumps(remade, sort_keys=True))
        )
        for name in choices_first(given):
            if name not in remade:
                set_value(data, name, copy.deepcopy(given[name]))
        return data

    def scenario(self, values: Sequence[Any], seed: int | None = None, source: str = "run") -> Scenario:
        """The scenario of a run.

        Args:
            values: one for every name.
            seed: seed of the run, unless ``run.seed`` is a parameter; the base's own when None.
            source: where errors say that the scenario comes from.

        Raises:
            InputError: a value is out of bounds or does not fit the others.
        """
        from hdsim.scenario.model import Scenario
        from hdsim.scenario.problems import Mark
        from hdsim.scenario.reader import Source
        from hdsim.scenario.validation import build

        data = self.data(values)
        if seed is not None and "run.seed" not in self.names:
            data.setdefault("run", {})["seed"] = seed
        return build(Source(data, {(): Mark(source)}), Scenario)


def remakes_base(name: str) -> bool:
    """Whether a parameter changes what the base is made from."""
    return name == PRESET or name.startswith(OPTIONS)


@lru_cache(maxsize=256)
def _base(base: str, written: str, remade: str) -> dict[str, Any]:
    """The base scenario as plain data, remade with another preset or other options."""
    given: dict[str, Any] = json.loads(base)
    changes: dict[str, Any] = json.loads(remade)
    options = {n.removeprefix(OPTIONS): v for n, v in changes.items() if n.startswith(OPTIONS)}
    if "scenario" in given:
        data: dict[str, Any] = given["scenario"]
        if options:
            raise InputError(
                f"found the parameter {OPTIONS}{next(iter(options))}, but a scenario has no options"
            )
        if PRESET in changes:
            before = json.loads(written)
            data["drive"] = before["drive"] | {"preset": changes[PRESET]}
            data["effects"] = before["effects"]
        return data
    from hdsim.studies.known_procedures import find_procedure

    section = dict(given["drive"])
    if PRESET in changes:
        section["preset"] = changes[PRESET]
    try:
        built = find_procedure(given["procedure"]).build(
            section, effects=given["effects"], run=given["run"], **(given["options"] | options)
        )
    except TypeError as error:
        raise InputError(f"procedure {given['procedure']!r}: {error}") from None
    return built.model_dump(mode="json")


@dataclass(frozen=True)
class Job:
    """One run of a batch."""

    index: int
    seed: int
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Batch:
    """Runs that travel together.

    Args:
        recipe: how to make their scenarios.
        metrics: what to measure.
        jobs: the runs.
        logs: folder for their MCAP logs, or None to keep none.
    """

    recipe: Recipe
    metrics: tuple[str, ...]
    jobs: tuple[Job, ...]
    logs: str | None = None


@dataclass
class Row:
    """What a run came to.

    Args:
        index: of the run.
        metrics: values by name; a metric that failed is missing.
        reason: why the run or a metric failed; empty when all is well.
        seconds: wall time of the run; not part of the results.
    """

    index: int
    metrics: dict[str, float] = field(default_factory=dict)
    reason: str = ""
    seconds: float = 0.0


def run_batch(batch: Batch) -> list[Row]:
    """Simulate and measure every run of a batch; a run that fails is a row with its reason."""
    from hdsim.contact.law import ValidityWarning

    with warnings.catch_warnings():
        # A thousand drives would say it a thousand times; ``hdsim run`` says it of the one that is looked at.
        warnings.simplefilter("ignore", ValidityWarning)
        return [_run(batch, job) for job in batch.jobs]


def _run(batch: Batch, job: Job) -> Row:
    started = time.perf_counter()
    row = Row(job.index)
    try:
        scenario = batch.recipe.scenario(job.values, job.seed, f"run {job.index}")
        log = None if batch.logs is None else Path(batch.logs) / f"run-{job.index:06d}.mcap"
        recording, failure = record(scenario, log)
        if failure:
            row.reason = f"the run stopped early: {failure}"
        else:
            row.metrics, row.reason = measured(batch.metrics, recording, scenario)
    except HdsimError as error:
        row.reason = str(error)
    except Exception as error:
        # One run must not cost the others, whatever a part or a metric of the user's does.
        row.reason = f"{type(error).__name__}: {error}"
    row.reason = " ".join(row.reason.split())[:2000]
    row.seconds = time.perf_counter() - started
    return row


def record(scenario: Scenario, log: Path | None = None) -> tuple[Recording, str]:
    """Simulate; with a log, write that and read it back.

    Returns:
        The recording and why it stopped early (empty when it did not).
    """
    if log is not None:
        from hdsim.log import open_log
        from hdsim.simulation.simulate import simulate_to_log

        log.parent.mkdir(parents=True, exist_ok=True)
        done = simulate_to_log(scenario, log)
        return open_log(log), done.failure or ""
    from hdsim.recording import Recording
    from hdsim.simulation.ensemble import record_at_once
    from hdsim.simulation.run import RunFailed
    from hdsim.simulation.setup import build_run

    # Without the provenance that ``simulate`` collects: the study keeps it once for all its runs.
    try:
        return record_at_once(build_run(scenario)), ""
    except RunFailed as error:
        return error.recording or Recording({}), str(error)


def measured(names: Sequence[str], recording: Recording, scenario: Scenario) -> tuple[dict[str, float], str]:
    """Metrics of a run (a time that never comes is infinite), and why those that are missing could not be
    taken.
    """
    from hdsim.studies.run_metrics import RunMetrics

    found = RunMetrics(recording, scenario)
    values: dict[str, float] = {}
    reasons: list[str] = []
    for name in names:
        try:
            values[name] = found[name].value
        except HdsimError as error:
            reasons.append(f"{name}: {error}")
    return values, "; ".join(reasons)


def warm_start() -> None:
    """Import what a run needs, and end with the process that started this one; initializer of worker
    processes.
    """
    import importlib
    import multiprocessing
    import os
    import threading
    from multiprocessing.connection import wait

    parent = multiprocessing.parent_process()
    if parent is not None:

        def follow() -> None:
            # Workers hold both ends of their queue, so they would wait for ever for a parent that was killed.
            wait([parent.sentinel])
            os._exit(1)

        threading.Thread(target=follow, daemon=True).start()
    importlib.import_module("hdsim.simulation.ensemble")
