"""Error budget: a positioning error split into its causes by switching them off and on.

With E(S) the error of a run in which the causes S are on, and N all of them:

    whole = E(N),  rest = E({}),  removed_i = E(N) - E(N without i),  alone_i = E({i}) - E({})
    interaction = whole - rest - sum removed_i

The interaction is zero when the causes add up (removed_i = alone_i); what couples them, such as a gap that
only a load closes, is in it and nowhere else. It is the remainder of a one-at-a-time analysis (Saltelli et
al. 2008, Global Sensitivity Analysis, section 1.2), and may exceed the whole. Shapley's shares
(``hdsim.studies.engine.shapley``) give it back to the causes: whole = rest + sum share_i.
"""

from __future__ import annotations

import copy
import csv
import json
import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import HdsimError, InputError
from hdsim.simulation.ensemble import InProcess, as_completed
from hdsim.studies.engine.causes import Cause, causes
from hdsim.studies.engine.shapley import (
    MOST_EXACT,
    Coalition,
    Share,
    coalitions,
    drawn_orders,
    shapley_shares,
)

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario.model import Scenario
    from hdsim.studies.metrics._spans import Dwell

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
        share: its Shapley share; None where only these two were asked for.
    """

    cause: Cause
    removed: float
    alone: float
    share: Share | None = None


@dataclass(frozen=True)
class Budget:
    """An error and its causes, all in ``unit``.

    Args:
        scenario: name of the scenario.
        error: what was split.
        unit: of all numbers.
        whole: the error with all causes; a positioning error has its sign, its size is the metric's.
        rest: the error with none of them.
        parts: the causes, largest first.
        runs: number of runs that were made.
        orders: number of orders that were drawn for the shares; 0: all combinations were run.
        swing_arcsec: amplitude of the limit cycle at rest whose mean a positioning error is; 0: none.
    """

    scenario: str
    error: str
    unit: str
    whole: float
    rest: float
    parts: tuple[Part, ...]
    runs: int
    orders: int = 0
    swing_arcsec: float = 0.0

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
        unit = self.unit
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            shares = [f"share [{unit}]", f"standard error of the share [{unit}]"]
            writer.writerow(["cause", *shares, f"removed [{unit}]", f"alone [{unit}]", "switched off"])
            for part in self.parts:
                share = ("", "") if part.share is None else (part.share.value, part.share.standard_error)
                writer.writerow([part.cause.title, *share, part.removed, part.alone, part.cause.switched])
            writer.writerow(["rest", self.rest, "", self.rest, self.rest, "error with all causes off"])
            together = (self.interaction, self.interaction_alone)
            writer.writerow(["interaction", "", "", *together, "whole less all of the above"])
            writer.writerow(["whole", self.whole, "", self.whole, self.whole, "error with all causes on"])
        return path


def error_budget(
    scenario: Scenario,
    *,
    metric: str | None = None,
    shares: bool = True,
    orders: int = 16,
    pool: Executor | None = None,
    width: int = 1,
    on_progress: Callable[[int, int], object] | None = None,
) -> Budget:
    """Split an error of a scenario into its causes.

    Args:
        scenario: what is positioned. With a position command and dwells, the error is output less
            commanded angle (arcsec, with its sign) at the dwell where it is largest, as the metric
            ``positioning_error``; without, it is the peak-to-peak transmission error of the run.
        metric: any metric by name, to be split instead.
        shares: find Shapley's shares: exactly, from all combinations, of up to six causes.
        orders: number of random orders from which the shares of more causes are estimated, two at least.
        pool: where the runs are made; in this process when None.
        width: runs at the same time.
        on_progress: called with the number of runs that are done and of all runs.

    Raises:
        InputError: the scenario has no cause that can be switched, or the metric does not fit it.
        HdsimError: a run stopped early, or its error is no finite number.
    """
    from hdsim.studies.known_metrics import find_metric

    found = causes(scenario)
    if not found:
        raise InputError("the scenario has no cause of error that can be switched off")
    names = [cause.name for cause in found]
    everything, nothing = frozenset(names), Coalition()
    drawn = drawn_orders(names, max(2, orders)) if shares and len(names) > MOST_EXACT else []
    wanted = [everything, nothing]
    for name in names:
        wanted += [everything - {name}, frozenset([name])]
    wanted += coalitions(names, drawn) if shares else []
    sets = list(dict.fromkeys(wanted))

    text = json.dumps(_prepared(scenario))
    whole_run, prepared = _run(text, everything)
    reference = whole_run["reference_angle"] if "reference_angle" in whole_run else None  # noqa: SIM401
    error, unit, dwell = _chosen(whole_run, metric)
    values = {everything: _value(whole_run, prepared, error, dwell, everything)}
    simulated = partial(_error, text, error=error, dwell=dwell, reference=reference)
    for done, (index, value) in enumerate(as_completed(simulated, sets[1:], pool or InProcess(), width), 2):
        values[sets[1 + index]] = value
        if on_progress is not None:
            on_progress(done, len(sets))
    whole, rest = values[everything], values[nothing]
    by_name = shapley_shares(names, values, drawn) if shares else {}
    parts = [
        Part(
            cause,
            whole - values[everything - {cause.name}],
            values[frozenset([cause.name])] - rest,
            by_name.get(cause.name),
        )
        for cause in found
    ]
    parts.sort(key=lambda part: -abs(part.removed if part.share is None else part.share.value))
    swing = 0.0 if dwell is None else find_metric("limit_cycle_amplitude")(whole_run, prepared)
    return Budget(scenario.name, error, unit, whole, rest, tuple(parts), len(sets), len(drawn), swing)


def _prepared(scenario: Scenario) -> dict[str, Any]:
    data = scenario.model_dump(mode="json")
    data["run"]["teeth_rate_hz"] = 0.0
    return data


def _chosen(recording: Recording, metric: str | None) -> tuple[str, str, Dwell | None]:
    """Name and unit of the error, and the dwell at which a positioning error is looked at."""
    from hdsim.studies.known_metrics import find_metric
    from hdsim.studies.metrics.motion import worst_dwell

    if metric is not None and metric != POSITIONING:
        return metric, find_metric(metric).unit, None
    try:
        return POSITIONING, "arcsec", worst_dwell(recording)
    except InputError:
        if metric is not None:
            raise
        return "transmission_error_peak_to_peak", "arcsec", None


def _value(recording: Recording, scenario: Scenario, error: str, dwell: Dwell | None, on: Coalition) -> float:
    """The error of a run.

    Raises:
        HdsimError: it is infinite.
    """
    from hdsim.studies.known_metrics import find_metric
    from hdsim.studies.metrics.motion import deviation

    if dwell is not None:
        return deviation(recording, dwell)
    found = find_metric(error)(recording, scenario)
    if not math.isfinite(found):
        raise HdsimError(f"{_with(on)}, {error} is {found}: what never ends cannot be split into causes")
    return found


def _error(text: str, on: Coalition, error: str, dwell: Dwell | None, reference: Array | None) -> float:
    """The error of a run with some causes on; runs on a worker."""
    from hdsim.recording import Column

    recording, scenario = _run(text, on)
    if reference is not None and "reference_angle" not in recording:
        # A prescribed motor has no controller that knows the command; the error is against it all the same.
        columns = recording.state.columns
        columns["reference_angle"] = Column(reference, "rad", "commanded angle, at the output")
        columns["tracking_error"] = Column(
            recording["output_angle"] - reference, "rad", "output less commanded"
        )
    return _value(recording, scenario, error, dwell, on)


def _with(on: Coalition) -> str:
    return f"with only {', '.join(sorted(on)) or 'nothing'} on"


def _run(text: str, on: Coalition) -> tuple[Recording, Scenario]:
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
    mesh = data["drive"]["mesh"]
    in_teeth = {"backlash", "kinematic_error"} & {cause.name for cause in off}
    if mesh["model"] == "tabulated" and in_teeth:
        # A gap cannot be closed in a finished table; the teeth themselves give the same torque.
        del mesh["twist_nodes"], mesh["angle_nodes"]
        mesh["model"] = "teeth"
    scenario = Scenario.model_validate(data)
    run = build_run(scenario)
    model = run.model
    if model.teeth is not None:
        numbers = model.system.reals[int(model.system.integers[_layout.MESH_AT]) :]
        for name in in_teeth:
            (model.teeth.close_gaps if name == "backlash" else model.teeth.remove_pitch_errors)(numbers)
    try:
        return record_at_once(run), scenario
    except RunFailed as error:
        raise HdsimError(f"{_with(on)}, the run stopped early: {error}") from error
