"""Pictures of a study: curves with bands, heat maps, histograms, tornados, sensitivity indices."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.plot import style, units
from hdsim.studies.engine.reading import described
from hdsim.studies.engine.sensitivity import Sensitivity, is_sensitivity
from hdsim.studies.engine.summary import MetricSummary
from hdsim.studies.engine.table import StudyTable

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.studies.engine.reading import Plan
    from hdsim.studies.registry import Metric

Array = NDArray[np.float64]

_SIZE = (8.5, 5.2)
_LINES = (style.BLUE, style.ORANGE, style.GREEN, style.BLACK, "#CC79A7", "#56B4E9", "#E69F00")


def study_figures(
    plan: Plan,
    table: StudyTable,
    summaries: Sequence[MetricSummary],
    sensitivities: Sequence[Sensitivity] = (),
) -> dict[str, Figure]:
    """Every picture that fits the design, by file name without ending.

    One stated number: a curve over it; two: a heat map; anything else that is stated: bars. Distributions or
    replicates alone: a histogram; distributions: a tornado; sensitivity designs: the indices.
    """
    found: dict[str, Figure] = {}
    factors = list(plan.study.factors)
    for metric in plan.metrics:
        mine = [s for s in summaries if s.metric == metric.name]
        if not any(s.runs > s.never for s in mine):
            continue
        numeric = [f for f in factors if _is_numeric(table, f)]
        if len(factors) == 2 and len(numeric) == 2 and all(_levels(table, f) > 2 for f in factors):
            found[f"{metric.name}-map"] = heat_map(plan, metric, mine, factors)
        elif numeric and len(factors) <= 2:
            found[f"{metric.name}-curve"] = curves(plan, metric, mine, numeric[-1], factors)
        elif factors:
            found[f"{metric.name}-bars"] = bars(plan, metric, mine)
        elif len(table) > 1:
            found[f"{metric.name}-histogram"] = histogram(plan, metric, table, mine[0])
        if sensitivities:
            ranked = [s for s in sensitivities if s.metric == metric.name]
            found[f"{metric.name}-sensitivity"] = sensitivity_bars(plan, metric, ranked)
        elif (
            plan.study.distributions
            and not is_sensitivity(plan.study)
            and len(table) > 2 * len(plan.study.distributions) + 2
        ):
            found[f"{metric.name}-tornado"] = tornado(plan, metric, table)
    return found


@contextmanager
def page(
    title: str, about: str, size: tuple[float, float] = _SIZE, wide: int = 105
) -> Iterator[tuple[Figure, Axes]]:
    """A figure with one pair of axes, a title and lines of ``wide`` letters that say what is shown."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(style.STYLE):
        figure = Figure(figsize=size, dpi=style.DPI, layout="constrained")
        axes = figure.subplots()
        figure.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
        axes.set_title(
            "\n".join(textwrap.wrap(about, wide)), fontweight="normal", fontsize=9, color="#444444"
        )
        yield figure, axes


def label(name: str, unit: str) -> str:
    """Axis label of a parameter or metric."""
    return name if unit in ("", "1") else f"{name} ({units.printed(unit)})"


def named(metric: Metric) -> str:
    """A metric's name in words."""
    return metric.name.replace("_", " ")


def _title(plan: Plan, metric: Metric) -> str:
    return f"{plan.study.name or 'study'}: {named(metric)}"


def _is_numeric(table: StudyTable, name: str) -> bool:
    values = table.columns[name].values
    return (
        all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
        and _levels(table, name) > 1
    )


def _levels(table: StudyTable, name: str) -> int:
    return len({repr(value) for value in table.columns[name].values})


def _logarithmic(axes: Axes, axis: str, values: Array) -> None:
    if np.all(values > 0) and values.max() > 50 * values.min():
        (axes.set_xscale if axis == "x" else axes.set_yscale)("log")


def words(point: dict[str, Any]) -> str:
    """A combination of stated values, for people."""
    return ", ".join(f"{described(name)} = {_short(value)}" for name, value in point.items())


def _short(value: Any) -> str:
    if value is None or value in ("null", "{}", {}):
        return "off" if value is None or value == "null" else "on"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def curves(
    plan: Plan, metric: Metric, summaries: Sequence[MetricSummary], over: str, factors: Sequence[str]
) -> Figure:
    """Mean over a parameter with the interval of the mean and the band of 90 % of the runs."""
    several = max(s.runs for s in summaries) > 1
    about = "mean of the runs at each value"
    if several:
        about = (
            f"line: mean with its {100 * plan.study.confidence:g} % confidence interval; band: 5 % to 95 % "
            f"quantile of {max(s.runs for s in summaries)} runs at each value"
        )
    with page(_title(plan, metric), f"{metric.description}. {about[0].upper()}{about[1:]}.") as (
        figure,
        axes,
    ):
        others = [name for name in factors if name != over]
        groups: dict[str, list[MetricSummary]] = {}
        for s in summaries:
            groups.setdefault(words({name: s.point[name] for name in others}), []).append(s)
        for k, (name, group) in enumerate(groups.items()):
            group = sorted((s for s in group if s.runs and not s.never), key=lambda s: float(s.point[over]))
            x = np.array([float(s.point[over]) for s in group])
            mean = np.array([s.mean.value for s in group])
            colour = _LINES[k % len(_LINES)]
            if several:
                axes.fill_between(
                    x, [s.low for s in group], [s.high.value for s in group], color=colour, alpha=0.15, lw=0
                )
                reach = np.array([[s.mean.value - s.mean.low, s.mean.high - s.mean.value] for s in group]).T
                axes.errorbar(
                    x, mean, np.nan_to_num(reach), color=colour, marker="o", ms=4, capsize=3, label=name
                )
            else:
                axes.plot(x, mean, color=colour, marker="o", ms=4, label=name)
            _logarithmic(axes, "x", x)
        axes.set_xlabel(label(described(over), plan.units[over]))
        axes.set_ylabel(label(named(metric), metric.unit))
        if len(groups) > 1:
            axes.legend(loc="best")
    return figure


def heat_map(
    plan: Plan, metric: Metric, summaries: Sequence[MetricSummary], factors: Sequence[str]
) -> Figure:
    """Mean over two parameters."""
    x_name, y_name = factors[1], factors[0]
    x = np.unique([float(s.point[x_name]) for s in summaries])
    y = np.unique([float(s.point[y_name]) for s in summaries])
    mean = np.full((len(y), len(x)), np.nan)
    never: set[tuple[int, int]] = set()
    for s in summaries:
        at = (
            int(np.searchsorted(y, float(s.point[y_name]))),
            int(np.searchsorted(x, float(s.point[x_name]))),
        )
        mean[at] = s.mean.value if np.isfinite(s.mean.value) else np.nan
        if s.never:
            never.add(at)
    about = f"{metric.description}. Colour and numbers: mean of {max(s.runs for s in summaries)} run(s)."
    with page(_title(plan, metric), about) as (figure, axes):
        axes.grid(False)
        shown = axes.pcolormesh(np.arange(len(x)), np.arange(len(y)), mean, cmap="viridis", shading="nearest")
        axes.set_xticks(range(len(x)), [f"{value:.3g}" for value in x])
        axes.set_yticks(range(len(y)), [f"{value:.3g}" for value in y])
        axes.set_xlabel(label(described(x_name), plan.units[x_name]))
        axes.set_ylabel(label(described(y_name), plan.units[y_name]))
        figure.colorbar(shown, ax=axes, label=label(named(metric), metric.unit))
        if mean.size <= 150:
            middle = 0.5 * (np.nanmin(mean) + np.nanmax(mean))
            for (row, column), value in np.ndenumerate(mean):
                gone = "never" if (row, column) in never else "failed"
                text = gone if np.isnan(value) else f"{value:.3g}"
                ink = "white" if not value > middle else "black"
                axes.text(column, row, text, ha="center", va="center", fontsize=8, color=ink)
    return figure


def bars(plan: Plan, metric: Metric, summaries: Sequence[MetricSummary]) -> Figure:
    """Mean of every combination of stated values, with interval."""
    size = (_SIZE[0], max(2.5, 1.6 + 0.32 * len(summaries)))
    interval = f"{plan.study.confidence:.0%} confidence interval of the mean"
    about = f"{metric.description}. Bar: mean; whisker: {interval}."
    with page(_title(plan, metric), about, size, 80) as (figure, axes):
        at = np.arange(len(summaries))[::-1]
        mean = np.array([s.mean.value for s in summaries])
        reach = np.array([[s.mean.value - s.mean.low, s.mean.high - s.mean.value] for s in summaries]).T
        mean = np.where(np.isfinite(mean), mean, 0.0)
        axes.barh(at, mean, xerr=np.nan_to_num(reach), color=style.BLUE, capsize=3)
        axes.set_yticks(at, [words(s.point) + (f" ({s.never} never)" if s.never else "") for s in summaries])
        axes.set_xlabel(label(named(metric), metric.unit))
        axes.grid(axis="y", visible=False)
    return figure


def histogram(plan: Plan, metric: Metric, table: StudyTable, summary: MetricSummary) -> Figure:
    """Distribution of a metric over all runs, with mean and 95 % quantile."""
    values = table.values(metric.name)
    good = values[np.isfinite(values)]
    failed = f" {summary.failed} more failed." if summary.failed else ""
    failed += f" {summary.never} more never." if summary.never else ""
    about = f"{metric.description}. {len(good)} runs.{failed}"
    with page(_title(plan, metric), about) as (figure, axes):
        edges = np.histogram_bin_edges(good, bins="fd" if np.ptp(good) > 0 else 1)
        edges = edges if len(edges) <= 81 else np.linspace(good.min(), good.max(), 81)
        axes.hist(good, bins=list(edges), color=style.BLUE, alpha=0.6, edgecolor="white", linewidth=0.5)
        for interval, colour, name in (
            (summary.mean, style.BLACK, "mean"),
            (summary.high, style.ORANGE, "95 % of the runs stay below"),
        ):
            if not np.isfinite(interval.value):
                continue
            text = f"{name} {interval.value:.4g} {metric.unit}"
            if np.isfinite(interval.low):
                text += f" ({plan.study.confidence:.0%} interval {interval.low:.4g} to {interval.high:.4g})"
                axes.axvspan(interval.low, interval.high, color=colour, alpha=0.15, lw=0)
            axes.axvline(interval.value, color=colour, lw=1.6, label=text)
        axes.set_xlabel(label(named(metric), metric.unit))
        axes.set_ylabel("runs")
        axes.set_ylim(0, axes.get_ylim()[1] * 1.2)
        axes.legend(loc="upper left")
    return figure


def swings(plan: Plan, metric: str, table: StudyTable) -> list[tuple[str, float, float, float, float]]:
    """What each sampled parameter does to a metric, by linear regression on all of them together.

    Returns:
        Largest first: name, metric at the parameter's 5 % and at its 95 % quantile (the others at their
        means), and those quantiles.
    """
    values = table.values(metric)
    names = list(plan.study.distributions)
    good = np.isfinite(values)
    x = np.stack([table.values(name)[good] for name in names], axis=1)
    centre, spread = x.mean(axis=0), x.std(axis=0)
    scaled = (x - centre) / np.where(spread > 0, spread, 1.0)
    slopes, *_ = np.linalg.lstsq(scaled, values[good] - values[good].mean(), rcond=None)
    found = []
    for k, name in enumerate(names):
        low, high = np.quantile(x[:, k], [0.05, 0.95])
        slope = slopes[k] / (spread[k] or 1.0)
        ends = values[good].mean() + slope * (np.array([low, high]) - centre[k])
        found.append((name, float(ends[0]), float(ends[1]), float(low), float(high)))
    return sorted(found, key=lambda entry: -abs(entry[2] - entry[1]))


def tornado(plan: Plan, metric: Metric, table: StudyTable) -> Figure:
    """How far each sampled parameter moves a metric, largest on top."""
    found = swings(plan, metric.name, table)
    values = table.values(metric.name)
    mean = float(np.mean(values[np.isfinite(values)]))
    about = (
        f"{metric.description}. Bars: mean of the metric as a parameter goes from its 5 % to its 95 % "
        f"quantile (numbers at the ends) and the others stay at their means; linear regression over "
        f"{int(np.isfinite(values).sum())} runs"
    )
    size = (_SIZE[0], max(2.8, 1.9 + 0.5 * len(found)))
    with page(_title(plan, metric), about + ".", size, 80) as (figure, axes):
        reach = max(abs(end - mean) for entry in found for end in entry[1:3]) or 1.0
        for k, (_name, at_low, at_high, low, high) in enumerate(reversed(found)):
            axes.barh(k, at_low - mean, left=mean, color=style.BLUE, height=0.6)
            axes.barh(k, at_high - mean, left=mean, color=style.ORANGE, height=0.6)
            for end, value, other in ((at_low, low, at_high), (at_high, high, at_low)):
                right = end > other or (end == other and value == high)
                axes.annotate(
                    f"{value:.3g}", (end, k), (4 if right else -4, 0), textcoords="offset points",
                    ha="left" if right else "right", va="center", fontsize=8,
                )  # fmt: skip
        axes.axvline(mean, color=style.BLACK, lw=1)
        axes.set_yticks(
            range(len(found)), [label(described(e[0]), plan.units[e[0]]) for e in reversed(found)]
        )
        axes.set_xlim(mean - 1.25 * reach, mean + 1.25 * reach)
        axes.set_xlabel(label(named(metric), metric.unit))
        axes.grid(axis="y", visible=False)
        from matplotlib.patches import Patch

        axes.legend(
            handles=[Patch(color=style.BLUE, label="low end"), Patch(color=style.ORANGE, label="high end")],
            loc="lower right",
        )
    return figure


def sensitivity_bars(plan: Plan, metric: Metric, found: Sequence[Sensitivity]) -> Figure:
    """What each parameter costs of a metric, in the metric's unit, largest on top."""
    ranked = sorted(found, key=lambda s: s.cost)
    sobol = plan.study.sampling is not None and plan.study.sampling.type == "sobol_indices"
    what = (
        "standard deviation of the metric that would remain if only this parameter (with its interactions) "
        "varied, sqrt(total Sobol index x variance); in brackets the first-order and the total index"
        if sobol
        else "mean size of the change as the parameter crosses its range (Morris' mu*); in brackets the "
        "standard deviation of that change"
    )
    size = (_SIZE[0], max(2.8, 1.9 + 0.42 * len(ranked)))
    with page(_title(plan, metric), f"{metric.description}. Bars: {what}.", size, 80) as (figure, axes):
        axes.barh(range(len(ranked)), [s.cost for s in ranked], color=style.BLUE, height=0.6)
        for k, s in enumerate(ranked):
            extra = f"{s.first:.2f}, {s.total:.2f}" if sobol else f"{s.first:.3g}"
            axes.annotate(
                f"{s.cost:.3g}  ({extra})",
                (s.cost, k),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
            )
        axes.set_xlim(0, 1.25 * max((s.cost for s in ranked), default=1.0) or 1.0)
        axes.set_yticks(range(len(ranked)), [described(s.parameter) for s in ranked])
        axes.set_xlabel(label(f"share of {named(metric)}", metric.unit))
        axes.grid(axis="y", visible=False)
    return figure
