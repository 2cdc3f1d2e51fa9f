"""Error budget: a positioning error split into its causes by switching them off, and on, one at a time.

With E(S) the error of a run in which the causes S are on, and N all of them:

    whole = E(N),  rest = E({}),  removed_i = E(N) - E(N without i),  alone_i = E({i}) - E({})
    interaction = whole - rest - sum removed_i

The interaction is zero when the causes add up (removed_i = alone_i); what couples them, such as a gap that
only a load closes, is in it and nowhere else. It is the remainder of a one-at-a-time analysis (Saltelli et
al. 2008, Global Sensitivity Analysis, section 1.2).
"""

from __future__ import annotations

import copy
import csv
import json
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import HdsimError, InputError
from hdsim.simulation.ensemble import InProcess
from hdsim.study.engine.causes import Cause, causes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.recording import Recording
    from hdsim.scenario.model import Scenario

Array = NDArray[np.float64]

#: Name of the error that is split when none is named: signed, at the dwell where it is largest.
POSITIONING = "positioning_error"


@dataclass(frozen=True)
class Part:
    """What one cause contributes.

    Args:
        cause: which.
        removed: how much the error falls when it alone is switched off.
        alone: how much the error grows when it alone is switched on.
    """

    cause: Cause
    removed: float
    alone: float


@dataclass(frozen=True)
class Budget:
    """An error and its causes, all in ``unit``.

    Args:
        scenario: name of the scenario.
        error: what was split.
        unit: of all numbers.
        whole: the error with all causes.
        rest: the error with none of them.
        parts: the causes, largest first.
    """

    scenario: str
    error: str
    unit: str
    whole: float
    rest: float
    parts: tuple[Part, ...]

    @property
    def interaction(self) -> float:
        """What the causes do together, beyond their parts one at a time."""
        return self.whole - self.rest - sum(part.removed for part in self.parts)

    @property
    def interaction_alone(self) -> float:
        """The same with the causes switched on one at a time."""
        return self.whole - self.rest - sum(part.alone for part in self.parts)

    def write_csv(self, path: Path) -> Path:
        """Write as CSV."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["cause", f"removed [{self.unit}]", f"alone [{self.unit}]", "switched off"])
            for part in self.parts:
                writer.writerow([part.cause.title, part.removed, part.alone, part.cause.switched])
            writer.writerow(["rest", self.rest, self.rest, "error with all causes off"])
            writer.writerow(
                ["interaction", self.interaction, self.interaction_alone, "whole less all of the above"]
            )
            writer.writerow(["whole", self.whole, self.whole, "error with all causes on"])
        return path


def error_budget(scenario: Scenario, *, metric: str | None = None, pool: Executor | None = None) -> Budget:
    """Split an error of a scenario into its causes.

    Args:
        scenario: what is positioned. With a position command and dwells, the error is output angle less
            commanded angle (arcsec, with its sign) at the dwell where it is largest, the mean over the last
            fifth of the dwell; without, it is the peak-to-peak transmission error of the run.
        metric: any metric by name, to be split instead.
        pool: where the runs are made; in this process when None.

    Raises:
        InputError: the scenario has no cause that can be switched, or the metric does not fit it.
        HdsimError: a run stopped early.
    """
    found = causes(scenario)
    if not found:
        raise InputError("the scenario has no cause of error that can be switched off")
    everything = tuple(cause.name for cause in found)
    pool = pool or InProcess()
    text = json.dumps(_prepared(scenario))
    whole_run, _ = _run(text, everything)
    reference = whole_run["reference_angle"] if "reference_angle" in whole_run else None  # noqa: SIM401
    error, unit, dwell = _chosen(whole_run, metric)

    sets: list[tuple[str, ...]] = [everything, ()]
    for name in everything:
        sets += [tuple(n for n in everything if n != name), (name,)]
    unique = list(dict.fromkeys(sets))
    futures = {s: pool.submit(_error, text, s, error, dwell, reference) for s in unique}
    values = {s: future.result() for s, future in futures.items()}
    whole, rest = values[everything], values[()]
    parts = [
        Part(
            cause,
            whole - values[tuple(n for n in everything if n != cause.name)],
            values[(cause.name,)] - rest,
        )
        for cause in found
    ]
    parts.sort(key=lambda part: -abs(part.removed))
    return Budget(scenario.name, error, unit, whole, rest, tuple(parts))


def _prepared(scenario: Scenario) -> dict[str, Any]:
    data = scenario.model_dump(mode="json")
    data["run"]["teeth_rate_hz"] = 0.0
    mesh = data["drive"]["mesh"]
    if mesh["model"] == "tabulated":
        # A gap cannot be closed in a finished table; the teeth themselves give the same torque.
        del mesh["twist_nodes"], mesh["angle_nodes"]
        mesh["model"] = "teeth"
    return data


def _chosen(recording: Recording, metric: str | None) -> tuple[str, str, tuple[int, int] | None]:
    """Name and unit of the error, and the samples over which a positioning error is the mean."""
    from hdsim.study.known_metrics import find_metric
    from hdsim.study.metrics._spans import dwells

    if metric is not None and metric != POSITIONING:
        return metric, find_metric(metric).unit, None
    try:
        rests = dwells(recording)
    except InputError:
        if metric is not None:
            raise
        return "transmission_error_peak_to_peak", "arcsec", None
    worst = max(rests, key=lambda rest: abs(rest.attained(recording["tracking_error"])))
    start, stop = worst.samples.start, worst.samples.stop
    return POSITIONING, "arcsec", (stop - max(1, (stop - start) // 5), stop)


def _error(
    text: str, on: tuple[str, ...], error: str, dwell: tuple[int, int] | None, reference: Array | None
) -> float:
    """The error of a run with some causes on; runs on a worker."""
    from hdsim.recording import Column
    from hdsim.study.known_metrics import find_metric

    recording, scenario = _run(text, on)
    if reference is not None and "reference_angle" not in recording:
        # A prescribed motor has no controller that knows the command; the error is against it all the same.
        columns = recording.state.columns
        columns["reference_angle"] = Column(reference, "rad", "commanded angle, at the output")
        columns["tracking_error"] = Column(
            recording["output_angle"] - reference, "rad", "output less commanded"
        )
    if dwell is None:
        return find_metric(error)(recording, scenario)
    return float(np.degrees(np.mean(recording["tracking_error"][slice(*dwell)])) * 3600.0)


def _run(text: str, on: tuple[str, ...]) -> tuple[Recording, Scenario]:
    """Simulate with the causes ``on`` and no others.

    Raises:
        HdsimError: the run stopped early.
    """
    from hdsim.drive import _layout
    from hdsim.scenario.model import Scenario
    from hdsim.simulation.ensemble import record_at_once
    from hdsim.simulation.run import RunFailed
    from hdsim.simulation.setup import build_run

    whole = Scenario.model_validate(json.loads(text))
    off = [cause for cause in causes(whole) if cause.name not in on]
    data = copy.deepcopy(json.loads(text))
    for cause in off:
        for effect in cause.effects:
            data["effects"][effect] = None
        if cause.change is not None:
            cause.change(data)
    scenario = Scenario.model_validate(data)
    run = build_run(scenario)
    model = run.model
    if model.teeth is not None:
        numbers = model.system.reals[int(model.system.integers[_layout.MESH_AT]) :]
        for cause in off:
            if cause.name == "backlash":
                model.teeth.close_gaps(numbers)
            elif cause.name == "kinematic_error":
                model.teeth.remove_pitch_errors(numbers)
    try:
        return record_at_once(run), scenario
    except RunFailed as error:
        raise HdsimError(
            f"with only {', '.join(on) or 'nothing'} on, the run stopped early: {error}"
        ) from error


def plot_budget(budget: Budget) -> Figure:
    """Waterfall: from the rest over every cause and the interaction to the whole."""
    from hdsim.plot import style
    from hdsim.study.engine.plots import page

    rows: list[tuple[str, float, str]] = [
        *((part.cause.title, part.removed, style.BLUE) for part in budget.parts),
        ("interaction", budget.interaction, style.GREY),
        ("rest (all off)", budget.rest, style.GREY),
    ]
    name = budget.error.replace("_", " ")
    about = (
        f"Bars add up to the whole: how much the {name} changes when one cause is switched off. "
        f"Ring: the cause alone, all others off; far from its bar's length, the causes work "
        f"together (interaction)."
    )
    if budget.error == POSITIONING:
        about = f"Output less commanded angle, at rest, where it is largest. {about}"
    size = (9.0, max(3.2, 2.0 + 0.45 * len(rows)))
    with page(f"{budget.scenario}: where the {name} comes from", about, size, 100) as (figure, axes):
        start, last = 0.0, len(rows)
        ends = [0.0]
        for k, (_title, value, colour) in enumerate(rows):
            at = last - k
            axes.barh(at, value, left=start, color=colour, height=0.6)
            if k < len(budget.parts):
                axes.plot(
                    start + budget.parts[k].alone, at, "o", mfc="white", mec=style.ORANGE, mew=1.6, ms=7
                )
                ends.append(start + budget.parts[k].alone)
            axes.plot([start + value] * 2, [at + 0.3, at - 1.3], color="#888888", lw=0.7)
            start += value
            ends.append(start)
        axes.barh(0, budget.whole, color=style.BLACK, height=0.6)
        low, high = min(ends), max(ends)
        pad = 0.16 * (high - low or 1.0)
        axes.set_xlim(low - pad * (low < 0), high + pad)
        names = [f"{title}  {value:+.3g}" for title, value, _ in rows] + [f"whole  {budget.whole:+.3g}"]
        axes.set_yticks(range(last, -1, -1), names)
        axes.axvline(0.0, color="#666666", lw=0.8)
        axes.set_xlabel(f"{name} ({budget.unit})")
        axes.grid(axis="y", visible=False)
    return figure
