"""From a required accuracy to the largest tolerance, by bisection over simulated drives."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.scenario.problems import Mark
from hdsim.scenario.reader import Source
from hdsim.simulation.ensemble import InProcess
from hdsim.studies.engine.definition import Base, Study, ValueList
from hdsim.studies.engine.design import drive_seed
from hdsim.studies.engine.execute import batches, execute
from hdsim.studies.engine.worker import Batch, Job, Row, run_batch

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.scenario.model import Scenario

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Probe:
    """The drives at one value of the parameter.

    Args:
        value: of the parameter.
        metric: one a drive, NaN where the run failed, shape (replicates,).
        quantile: the metric that the wanted share of the drives does not exceed (failed drives exceed all).
        passing: share of the drives within the limit.
        reasons: why drives gave no number, with how many.
    """

    value: float
    metric: Array
    quantile: float
    passing: float
    reasons: tuple[tuple[str, int], ...] = ()

    @property
    def given(self) -> int:
        """Number of drives that gave a number."""
        return int(np.count_nonzero(~np.isnan(self.metric)))


@dataclass(frozen=True)
class Tolerance:
    """The answer, and how it was found.

    Args:
        metric: name of the metric.
        unit: its unit.
        limit: largest allowed value of the metric.
        parameter: name of the parameter.
        parameter_unit: its unit.
        confidence: share of the drives that must meet the limit.
        value: the extreme value of the parameter that meets it; None when no probed value does.
        whole_range: whether all of the range meets it, so that ``value`` is only the range's end.
        yield_low: lower end of the one-sided interval of the share of drives that meet the limit there
            (Clopper and Pearson 1934), at the same confidence.
        probes: all probes, by value.
    """

    metric: str
    unit: str
    limit: float
    parameter: str
    parameter_unit: str
    confidence: float
    value: float | None
    whole_range: bool
    yield_low: float
    probes: tuple[Probe, ...]

    def write_csv(self, path: Path) -> Path:
        """Write the probes as CSV."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            unit = "" if self.parameter_unit == "1" else f" [{self.parameter_unit}]"
            writer.writerow([self.parameter + unit, f"quantile [{self.unit}]", "passing", "drives"])
            for probe in self.probes:
                writer.writerow([probe.value, probe.quantile, probe.passing, len(probe.metric)])
        return path


def find_tolerance(
    base: Scenario | Base,
    *,
    metric: str,
    limit: float,
    parameter: str,
    confidence: float = 0.95,
    replicates: int = 20,
    low: float | None = None,
    high: float | None = None,
    logarithmic: bool | None = None,
    precision: float = 0.01,
    seed: int = 0,
    pool: Executor | None = None,
    width: int = 1,
    on_probe: Callable[[Probe], object] | None = None,
) -> Tolerance:
    """The extreme value of a parameter at which a share of all drives still meets a limit.

    Every value is tried on the same drives (common random numbers), so that the metric is a smooth function
    of the parameter for each and the bisection does not chase noise. The metric has to rise or fall with the
    parameter over the range; the found value lies next to the end that meets the limit.

    Args:
        base: a scenario, or what a study's base says: a bench procedure and its drive.
        metric: name of the metric.
        limit: its largest allowed value, in its unit.
        parameter: dotted name of the parameter.
        confidence: share of the drives that must meet the limit.
        replicates: drives with other random surfaces and noise, the first one the base's own.
        low: lower end of the range; a hundredth of the base's value when None.
        high: upper end; a hundred times the base's value when None.
        logarithmic: bisect ratios; when None, if both ends are above 0 and a factor 10 apart.
        precision: width of the last interval, relative to the value (or to the range when not logarithmic).
        seed: seed of the drives.
        pool: where the runs are made.
        width: runs at the same time.
        on_probe: called with every probe.

    Raises:
        InputError: unknown names, a range that the parameter does not allow, or a metric that no run gives.
    """
    from hdsim.scenario.names import get_value
    from hdsim.studies.engine.reading import base_recipe, plan

    if not isinstance(base, Base):
        base = Base(scenario=base.model_dump(mode="json"))
    if low is None or high is None:
        source = Source(base.model_dump(mode="json"), {(): Mark("base")})
        now = get_value(base_recipe(base, (), source)[0].model_dump(mode="json"), parameter)
    else:
        now = None
    if now is not None and (isinstance(now, bool) or not isinstance(now, int | float) or now <= 0):
        raise InputError(f"{parameter} is {now!r} in the scenario: give the range with --low and --high")
    if now is None and (low is None or high is None):
        raise InputError(f"{parameter} has no value in the scenario: give the range with --low and --high")
    low = float(now or 0.0) / 100 if low is None else low
    high = float(now or 0.0) * 100 if high is None else high
    if not low < high:
        raise InputError(f"the range must rise, found {low:g} to {high:g}")
    # A study of the two ends checks names, types and bounds with the messages of any study.
    ends = Study(
        name="tolerance",
        base=base,
        parameters={parameter: ValueList(type="list", values=[low, high])},
        metrics=[metric],
    )
    checked = plan(ends)
    logarithmic = (low > 0 and high >= 10 * low) if logarithmic is None else logarithmic
    if logarithmic and low <= 0:
        raise InputError(f"a logarithmic bisection needs a range above 0, found {low:g}")
    seeds = [drive_seed(checked.scenario.run.seed, seed, k) for k in range(replicates)]
    executor = pool or InProcess()
    probes: list[Probe] = []

    # A metric of another test is missing from every run: the first drive tells.
    alone = [run_batch(Batch(checked.recipe, (metric,), (Job(0, seeds[0], (low,)),)))[0]]
    if alone[0].reason.startswith(f"{metric}: "):
        alone += run_batch(Batch(checked.recipe, (metric,), (Job(0, seeds[0], (high,)),)))
        if not any(row.metrics for row in alone):
            raise InputError(_nothing(checked.scenario.name, metric, [(alone[0].reason, 1)]))

    def probe(value: float) -> bool:
        jobs = [Job(k, s, (value,)) for k, s in enumerate(seeds)]
        rows: dict[int, Row] = {}
        execute(
            batches(checked.recipe, [metric], jobs, width),
            executor,
            width,
            lambda done: rows.update({row.index: row for row in done}),
        )
        values = np.array([rows[k].metrics.get(metric, np.nan) for k in range(replicates)])
        worst_first = np.where(np.isnan(values), np.inf, values)
        quantile = float(np.quantile(worst_first, confidence, method="higher"))
        reasons = Counter(row.reason for row in rows.values() if row.reason)
        found = Probe(
            value, values, quantile, float(np.mean(worst_first <= limit)), tuple(reasons.most_common())
        )
        probes.append(found)
        if on_probe is not None:
            on_probe(found)
        return quantile <= limit

    ok_low, ok_high = probe(low), probe(high)
    if not any(probe.given for probe in probes):
        raise InputError(_nothing(checked.scenario.name, metric, probes[0].reasons))
    whole_range = ok_low and ok_high
    value: float | None = None
    if whole_range:
        value = high
    elif ok_low or ok_high:
        good, bad = (low, high) if ok_low else (high, low)
        while not _close(good, bad, precision, high - low, logarithmic):
            middle = math.sqrt(good * bad) if logarithmic else 0.5 * (good + bad)
            if probe(middle):
                good = middle
            else:
                bad = middle
        value = good
    unit = checked.metrics[0].unit
    at = next((p for p in probes if p.value == value), None)
    return Tolerance(
        metric, unit, limit, parameter, checked.units[parameter], confidence, value, whole_range,
        0.0 if at is None else _yield_low(at, confidence), tuple(sorted(probes, key=lambda p: p.value)),
    )  # fmt: skip


def _nothing(name: str, metric: str, reasons: Sequence[tuple[str, int]]) -> str:
    """What is wrong when no run gives the metric, and what test would."""
    from hdsim.studies.known_procedures import procedures

    why = reasons[0][0].removeprefix(f"{metric}: ") if reasons else "it is no finite number"
    tests = [one.name for one in procedures().values() if metric in one.metrics]
    hint = f"; a bench procedure that does: {', '.join(tests)}" if tests else ""
    return f"no run of {name!r} gives {metric}: {why}{hint}"


def _close(good: float, bad: float, precision: float, span: float, logarithmic: bool) -> bool:
    if logarithmic:
        return abs(math.log(bad / good)) <= precision
    return abs(bad - good) <= precision * span


def _yield_low(probe: Probe, confidence: float) -> float:
    from scipy.stats import binomtest

    count = len(probe.metric)
    found = binomtest(round(probe.passing * count), count, alternative="greater")
    return float(found.proportion_ci(confidence, method="exact").low)


def plot_tolerance(found: Tolerance) -> Figure:
    """Metric over the parameter: every drive, the wanted quantile, the limit and the answer."""
    from hdsim.plot import style
    from hdsim.studies.engine.plots import label, page
    from hdsim.studies.engine.reading import described

    probes: Sequence[Probe] = found.probes
    name = found.metric.replace("_", " ")
    about = (
        f"Dots: single drives, {len(probes[0].metric)} at every value, always the same ones. Line: what "
        f"{found.confidence:.0%} of them do not exceed."
    )
    with page(f"How much {described(found.parameter)} the limit allows", about) as (figure, axes):
        x = np.array([p.value for p in probes])
        for p in probes:
            axes.plot(np.full(len(p.metric), p.value), p.metric, ".", color=style.BLUE, alpha=0.35, ms=4)
        shown = np.array([p.quantile if np.isfinite(p.quantile) else np.nan for p in probes])
        axes.plot(
            x, shown, "-o", ms=4, color=style.BLUE, label=f"{found.confidence:.0%} of the drives stay below"
        )
        axes.axhline(found.limit, color=style.ORANGE, label=f"limit {found.limit:g} {found.unit}")
        if found.value is not None:
            axes.axvline(
                found.value, color=style.GREEN, ls="--", label=f"{'at least ' if found.whole_range else ''}"
                f"{found.value:.4g} {found.parameter_unit}",
            )  # fmt: skip
        if x[0] > 0 and x[-1] > 10 * x[0]:
            axes.set_xscale("log")
        every = np.concatenate([p.metric for p in probes])
        finite = every[np.isfinite(every)]
        lowest, highest = (float(f(finite)) if len(finite) else found.limit for f in (np.min, np.max))
        room = found.limit - lowest
        if highest > found.limit + 4 * room > found.limit:
            # Far beyond the limit a drive may not work at all; what matters is the way there.
            axes.set_ylim(lowest - 0.2 * room, found.limit + 4 * room)
        axes.set_xlabel(label(described(found.parameter), found.parameter_unit))
        axes.set_ylabel(label(name, found.unit))
        axes.legend(loc="upper left")
    return figure
