"""Simulate a scenario: in memory, or straight into a log."""

from __future__ import annotations

import json
import math
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hdsim.scenario import loaded
from hdsim.simulation.run import Run, RunFailed
from hdsim.simulation.setup import build_run

if TYPE_CHECKING:
    from mcap import records

    from hdsim.recording import Recording
    from hdsim.scenario import Scenario

#: Packages whose versions a log keeps.
_PACKAGES = ("hdsim", "numpy", "scipy", "numba", "control", "mcap", "pydantic")


def simulate(
    scenario: Scenario | str | Path,
    *,
    on_time: Callable[[float], object] | None = None,
    strict: bool = True,
    sensitivities: Sequence[str] = (),
) -> Recording:
    """Simulate a scenario and keep the result in memory.

    Args:
        scenario: what to simulate, or its file.
        on_time: called now and then with the simulated time that has been reached, s.
        strict: raise when the run stops early; else return what was computed, with the event that says why.
        sensitivities: dotted names of numbers of the scenario; ``result.sensitivities[name][channel]`` is
            then how the channel changes with the number (``hdsim.simulation.sensitivities``).

    Returns:
        The recording, with tables ``state`` and ``teeth``, static arrays, events and provenance.

    Raises:
        RunFailed: the run stopped early; its ``recording`` holds what was computed.
        InputError: one of the numbers has no sensitivity.
    """
    from hdsim.simulation.sensitivities import derivatives, models_beside

    scenario = loaded(scenario)
    # First of all: what has no derivative is said before the run.
    beside = models_beside(scenario, sensitivities) if sensitivities else None
    run = build_run(scenario)
    started = time.perf_counter()
    recording = run.record(on_time)
    recording.metadata.update(provenance(scenario) | _for_replay(run))
    recording.metadata.update(summary(run, time.perf_counter() - started))
    if run.interrupted is not None:
        raise run.interrupted
    if run.failure and strict:
        error = RunFailed(run.failure)
        error.recording = recording
        raise error
    if beside is not None and not run.failure:
        recording.sensitivities = derivatives(beside, scenario, recording)
    return recording


class Spectator(Protocol):
    """Who watches a run while it is simulated (``hdsim.live``)."""

    def attach(self, run: Run) -> None:
        """Called before the run begins."""

    def watch(
        self,
        schema: records.Schema,
        channel: records.Channel,
        log_times: Sequence[int],
        bodies: Sequence[bytes],
    ) -> None:
        """Called with messages as they are written to the log."""

    def computed(self, time: float) -> None:
        """Called when the log is complete up to a time, s."""


def simulate_to_log(
    scenario: Scenario,
    path: str | Path,
    *,
    on_time: Callable[[float], object] | None = None,
    live: Spectator | None = None,
) -> Run:
    """Simulate a scenario and write its log block by block, so that a stopped run keeps what it computed.

    Args:
        scenario: what to simulate.
        path: the log; ``<path>.partial`` until it is complete.
        on_time: called now and then with the simulated time that has been reached, s.
        live: watches the run while it is simulated.

    Returns:
        The run, with audit, statistics and, if it stopped early, its ``failure``.
    """
    from hdsim.log import LogWriter
    from hdsim.log.scene import SceneWriter
    from hdsim.log.scene_geometry import SceneGeometry, rounded_up
    from hdsim.log.view import view_rate

    run = build_run(scenario)
    started = time.perf_counter()
    static = run.static()
    metadata = provenance(scenario) | _for_replay(run)
    with LogWriter(
        path,
        metadata=metadata,
        attachments={"scenario.yaml": metadata["scenario"]},
        view_rate_hz=view_rate(scenario.run.duration_s),
        compression=scenario.log.compression,
        watch=None if live is None else live.watch,
    ) as log:
        if live is not None:
            live.attach(run)
        scene = None
        if scenario.log.scene:
            geometry = SceneGeometry.from_metadata(metadata)
            if run.model.teeth is not None:
                # The colours reach to twice the mean tooth force at rated torque.
                teeth = run.model.teeth
                geometry = replace(
                    geometry,
                    largest_force_n=rounded_up(2 * teeth.rated_tooth_force_n),
                    half_gap_m=float(np.mean(teeth.half_gaps_m)) * teeth.radius_m / teeth.lever_m,
                )
            scene = SceneWriter(log, geometry, scenario.run.duration_s)
        if static:
            log.write_static(static)
        told = 0
        for tables in run.blocks(on_time):
            for name, table in tables.items():
                log.write(name, table)
            if scene is not None:
                scene.write(tables)
            for event in run.events[told:]:
                log.write_event(event)
            told = len(run.events)
            if live is not None:
                live.computed(float(tables["state"].time[-1]))
        for event in run.events[told:]:
            log.write_event(event)
        log.close(summary(run, time.perf_counter() - started))
        if live is not None:
            live.computed(scenario.run.duration_s)
    if run.interrupted is not None:
        raise run.interrupted
    return run


def provenance(scenario: Scenario) -> dict[str, str]:
    """What made a run: scenario, versions, git state, seed, solver and tolerances."""
    settings = scenario.run
    found = {
        "scenario_name": scenario.name,
        "scenario": scenario.to_yaml(),
        "seed": str(settings.seed),
        "method": settings.method,
        "rtol": repr(settings.rtol),
        "atol": "rtol times each state's scale" if settings.atol is None else repr(settings.atol),
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
    geometry = scenario.drive.geometry
    drawn: dict[str, float] = {
        "flexspline_teeth": geometry.flexspline_teeth,
        "circular_spline_teeth": geometry.circular_spline_teeth,
        "pitch_radius_m": geometry.pitch_radius_m,
        "circular_spline_fixed": scenario.drive.arrangement == "circular_spline_fixed",
    }
    gravity = scenario.load.gravity
    if gravity is not None:
        # Where it hangs, the arm points down.
        drawn |= {"gravity": True, "arm_angle_rad": -math.pi / 2 - math.radians(gravity.hanging_angle_deg)}
    found["geometry"] = json.dumps(drawn)
    found |= {f"version_{name}": version(name) for name in _PACKAGES}
    git = _git_state()
    if git:
        found["git"] = git
    return found


def _for_replay(run: Run) -> dict[str, str]:
    """What layouts know of a run before it begins: the torques that its lines are held against."""
    from hdsim.log.facts import KEY
    from hdsim.simulation.events import torque_limit

    limit = torque_limit(run.model)
    facts = {"rated_torque_nm": run.model.rated_torque_nm}
    if math.isfinite(limit):
        facts["torque_limit_nm"] = limit
    return {KEY: json.dumps(facts)}


def summary(run: Run, seconds: float) -> dict[str, str]:
    """What came out of a run: work of the solver and the energy audit."""
    statistics = run.statistics
    found = {
        "wall_time_s": f"{seconds:.3f}",
        "steps": str(statistics.steps),
        "right_hand_sides": str(statistics.nfev),
        "energy_residual_j": f"{run.audit.residual:.3e}",
        "energy_exchanged_j": f"{run.audit.exchanged:.3e}",
        "energy_residual_relative": f"{run.audit.relative:.3e}",
    }
    if run.audit.gave_back:
        found["energy_from_nothing"] = f"{run.audit.gave_back} gave back {run.audit.given_back:.3e} J"
    teeth = run.model.teeth
    if teeth is not None and teeth.table_error is not None:
        found["mesh_table_error"] = f"{teeth.table_error:.3e} of the rated torque"
    if run.failure:
        found["failure"] = run.failure
    return found


def _git_state() -> str:
    """Commit of the checkout that hdsim runs from, with ``+`` for uncommitted changes; empty elsewhere."""
    import subprocess

    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    try:
        commit = subprocess.run(
            ["git", "describe", "--always", "--abbrev=12", "--dirty=+"],
            cwd=root,
            capture_output=True,
            text=True,
            timeout=5,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return commit.stdout.strip()
