"""Figures of a diagnosis: held-out residuals, measurement and model over time, an unidentified effect."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.log.outliers import runs_of
from hdsim.plot import style, units
from hdsim.tell.words import UNKNOWN, spoken, unit_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.diagnosis.further import CurveFound
    from hdsim.diagnosis.verdict import Verdict
    from hdsim.estimate.found import Gap
    from hdsim.estimate.records import Array, Mask
    from hdsim.tell.findings import Compared, Findings

#: Most points of a drawn line.
POINTS = 3000
#: Width of every figure, inches: with these the text is as large as the page's.
WIDTH = 10.6
#: Samples, and least time in s, of the stretch that is shown closely.
STRETCH_SAMPLES, STRETCH_S = 900, 0.8
#: Colours of the models, and of what was measured.
MEASURED, BEFORE, REFIT, STEP, AFTER = style.BLACK, style.ORANGE, "#E69F00", "#8FCFB8", style.GREEN
#: The models in legends, by stage.
MODELS = {"before": "model before", "after": "model after"}


Bars = list[tuple[str, float, tuple[float, float] | None, str]]
"""Label, height, 95 % interval and colour of bars, SI units."""


def gap_bars(found: Findings) -> dict[str, Bars]:
    """RMS residual of each channel on held-out data: as given, re-fitted, with each effect, final."""
    verdict = found.verdict
    curve = verdict.verdict == "unknown" and verdict.curve is not None
    many = len(verdict.effects)
    last = "with the effect" if many < 2 else "with both effects" if many == 2 else f"with all {many} effects"
    last = "with the curve" if curve else last
    # Where nothing is added, the re-fitted model is what comes out.
    own = REFIT if verdict.verdict in ("effect", "unknown") else AFTER
    bars: dict[str, Bars] = {}
    for channel, gap in verdict.gap.items():
        bars[channel] = [
            ("model as given", gap.before, gap.intervals.get("before"), BEFORE),
            ("parameters re-fitted", gap.refit, gap.intervals.get("refit"), own),
        ]
        for step in found.steps:
            label = "with " + ", ".join(map(spoken, step.effects))
            value, interval = step.gap[channel]
            bars[channel].append((label, value, interval, STEP))
        if verdict.verdict == "effect" or curve:
            bars[channel].append((last, gap.after, gap.intervals.get("after"), AFTER))
    return bars


def gap_figure(verdict: Verdict, found: dict[str, Bars]) -> Figure | None:
    """Bars of the held-out RMS residual (see `gap_bars`); dashed, the channel's noise."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    if not verdict.gap:
        return None
    with rc_context(style.STYLE):
        most = max(map(len, found.values()))
        figure = Figure(figsize=(WIDTH, 0.95 + 0.33 * most), layout="constrained")
        grid = figure.subplots(1, len(verdict.gap), squeeze=False, sharey=True)[0]
        for axes, (channel, gap) in zip(grid, verdict.gap.items(), strict=True):
            _gap_panel(axes, gap, found[channel])
            axes.set_title(spoken(channel))
        grid[0].invert_yaxis()
    return figure


def _gap_panel(axes: Axes, gap: Gap, bars: Bars) -> None:
    unit = unit_of(gap)
    ends = [*(b[1] for b in bars), *(b[2][1] for b in bars if b[2]), gap.noise]
    reach = max((end for end in ends if np.isfinite(end)), default=0.0) or 1.0
    for k, (_, value, interval, colour) in enumerate(bars):
        if not np.isfinite(value):
            axes.text(0.03 * unit.factor * reach, k, UNKNOWN, va="center", fontsize=8.5)
            continue
        low, high = interval or (value, value)
        spread = unit.factor * np.array([[max(value - low, 0.0)], [max(high - value, 0.0)]])
        axes.barh(k, unit.factor * value, 0.68, color=colour, xerr=spread, ecolor="#444444", capsize=2.5)
        share = f"{100 * value / gap.before:.0f} %" if gap.before > 0 else ""
        end = unit.factor * (max(value, high) + 0.03 * reach)
        axes.text(end, k, f"{unit.factor * value:.3g}  ({share})", va="center", fontsize=8.5)
    if np.isfinite(gap.noise):
        axes.axvline(unit.factor * gap.noise, color=style.BLACK, linestyle="--", linewidth=1.1)
    axes.set_xlim(0, 1.45 * unit.factor * reach)
    axes.set_yticks(range(len(bars)), [bar[0] for bar in bars])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel(f"RMS residual ({unit.name})")


def trace_figure(found: Findings) -> Figure | None:
    """A stretch of held-out data in detail: measurement and models, and their residuals beside it."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    chosen = _proved(found)
    if not chosen:
        return None
    with rc_context(style.STYLE):
        figure = Figure(figsize=(WIDTH, 0.5 + 2.0 * len(chosen)), layout="constrained")
        grid = figure.subplots(len(chosen), 2, squeeze=False, width_ratios=[1.15, 1])
        stretches: dict[int, slice] = {}
        for (left, right), series in zip(grid, chosen, strict=True):
            if series.record not in stretches:
                own = [other for other in chosen if other.record == series.record]
                off = [np.where(s.hold, s.left["before"] / (s.noise or 1.0), 0.0) for s in own]
                stretches[series.record] = worst_stretch(series.time, off, series.hold)
            _closely(left, right, series, stretches[series.record])
        handles, labels = grid[0, 0].get_legend_handles_labels()
        band = grid[0, 1].get_legend_handles_labels()
        figure.legend(
            [*handles, band[0][-1]], [*labels, band[1][-1]], loc="outside upper right", ncols=4, fontsize=9.5
        )
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
    return figure


def _closely(left: Axes, right: Axes, series: Compared, rows: slice) -> None:
    """Measurement and models over a stretch, and beside it both residuals with the noise."""
    time, good = series.time[rows], (series.train | series.hold)[rows]
    measured = series.measured[rows]
    if _is_error(series):
        measured = measured - series.ideal[rows]
        measured = measured - measured.mean()
    measured = np.where(good, measured, np.nan)
    unit = _unit(series, measured)
    left.plot(time, unit.factor * measured, color=MEASURED, linewidth=0.9, label="measured")
    rest_unit = _unit(series, *(series.left[stage][rows] for stage in ("before", "after")))
    for stage, colour in (("before", BEFORE), ("after", AFTER)):
        rest = np.where(good, series.left[stage][rows], np.nan)
        left.plot(time, unit.factor * (measured - rest), color=colour, linewidth=1.2, label=MODELS[stage])
        right.plot(time, rest_unit.factor * rest, color=colour, linewidth=0.9, label=stage)
    right.axhspan(
        *(s * rest_unit.factor * series.noise for s in (-2, 2)),
        color="#BBBBBB", alpha=0.45, zorder=0, linewidth=0, label="noise (95 %)",
    )  # fmt: skip
    name = "transmission error" if _is_error(series) else spoken(series.channel)
    left.set_title(f"{name} ({unit.name})")
    right.set_title(f"residual ({rest_unit.name})")


def whole_figure(found: Findings) -> Figure | None:
    """Residual of each channel over the whole record, held-out stretches shaded."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    chosen = _proved(found)
    if not chosen:
        return None
    with rc_context(style.STYLE):
        figure = Figure(figsize=(WIDTH, 0.6 + 1.35 * len(chosen)), layout="constrained")
        grid = figure.subplots(len(chosen), 1, squeeze=False)[:, 0]
        for axes, series in zip(grid, chosen, strict=True):
            time, good = series.time, series.train | series.hold
            thin = max(1, len(time) // POINTS)
            unit = _unit(series, *(series.left[stage][good] for stage in ("before", "after")))
            for stage, colour in (("before", BEFORE), ("after", AFTER)):
                rest = np.where(good, unit.factor * series.left[stage], np.nan)
                axes.plot(time[::thin], rest[::thin], color=colour, linewidth=0.7, label=MODELS[stage])
            for a, b in _runs(series.hold):
                axes.axvspan(time[a], time[b - 1], color="#EFEFEF", zorder=0)
            axes.set_xlim(time[0], time[-1])
            axes.set_title(f"{spoken(series.channel)}: residual ({unit.name})")
        legend_above(grid[0])
        grid[-1].set_xlabel("time (s)")
    return figure


def _proved(found: Findings) -> list[Compared]:
    """One series with held-out samples of each channel."""
    chosen: dict[str, Compared] = {}
    for series in found.series:
        if series.hold.any():
            chosen.setdefault(series.channel, series)
    return list(chosen.values())


def _is_error(series: Compared) -> bool:
    return series.channel == "output_angle"


def _unit(series: Compared, *curves: Array) -> units.Unit:
    size = units.largest(*curves)
    return units.for_error(size) if series.channel.endswith("angle") else units.for_torque(size)


def _runs(flags: Mask, least: int = 20) -> list[tuple[int, int]]:
    """First sample of each run of true that is long enough, and the one after its last."""
    return [(a, b) for a, b in runs_of(flags) if b - a >= least]


def worst_stretch(time: Array, off: Sequence[Array], hold: Mask) -> slice:
    """The stretch of held-out samples, short enough to be read, with the largest residual.

    Args:
        time: shape (n,), s.
        off: residuals of the channels, each over its noise, shape (n,).
        hold: held-out samples.
    """
    runs = _runs(hold) or [(0, len(time))]
    gain = np.concatenate([[0.0], np.cumsum(np.sum(np.square(off), axis=0))])
    period = float(np.median(np.diff(time)))
    count = max(STRETCH_SAMPLES, int(STRETCH_S / period))
    best, chosen = -1.0, slice(*runs[0])
    for a, b in runs:
        starts = np.arange(a, max(a + 1, b - count + 1), max(1, count // 10))
        ends = np.minimum(starts + count, b)
        means = (gain[ends] - gain[starts]) / (ends - starts)
        k = int(np.argmax(means))
        if means[k] > best:
            best, chosen = float(means[k]), slice(int(starts[k]), int(ends[k]))
    return chosen


def legend_above(axes: Axes) -> None:
    """A legend above the panel, at its right: it covers no curve and no title."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, borderaxespad=0.1)


def curve_figure(curve: CurveFound) -> Figure:
    """The curve of an unidentified effect, with the 95 % interval of each node."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    values, bounds = np.array(curve.values), np.array(curve.intervals)
    unit = (
        units.for_error(units.largest(values))
        if curve.unit == "rad"
        else units.for_torque(units.largest(values))
    )
    at = np.array(curve.at)
    across = units.Unit(curve.coordinate_unit, 1.0)
    if curve.coordinate_unit == "rad":
        across = units.for_angle(float(np.max(np.abs(at))))
    if curve.period is not None:
        at = np.append(at, at[0] + curve.period)
        values, bounds = np.append(values, values[0]), np.vstack([bounds, bounds[:1]])
    with rc_context(style.STYLE):
        figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(
            across.factor * at, *(unit.factor * bounds.T), color="#C9A6D6", alpha=0.6, linewidth=0,
            label="95 % interval",
        )  # fmt: skip
        axes.plot(across.factor * at, unit.factor * values, "o-", color="#7A2E91", label="curve")
        axes.axhline(0.0, color="#888888", linewidth=0.8)
        axes.set_xlabel(f"{spoken(curve.coordinate)} ({across.name})")
        axes.set_ylabel(f"{curve.words.partition(' over ')[0]} ({unit.name})")
        legend_above(axes)
    return figure
