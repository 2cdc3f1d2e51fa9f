"""Figures of a diagnosis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.diagnose.locate import Place
    from hdsim.diagnose.measured import Array
    from hdsim.diagnose.verdict import Verdict
    from hdsim.diagnose.workflow import Diagnosis

#: Most points of a drawn line.
POINTS = 4000


def gap_figure(verdict: Verdict) -> Figure | None:
    """Bars of the held-out gap before, after the re-fit and with the effects, as multiples of the noise."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    if not verdict.gap:
        return None
    with rc_context(style.STYLE):
        figure = Figure(figsize=(9.0, 1.0 + 0.75 * len(verdict.gap)), layout="constrained")
        axes = figure.subplots()
        names = list(verdict.gap)
        stages = (("before", style.GREY), ("refit", style.BLUE), ("after", style.ORANGE))
        for k, (stage, colour) in enumerate(stages):
            gaps = [verdict.gap[name] for name in names]
            scale = [g.noise or g.variation or 1.0 for g in gaps]
            values = np.array([getattr(g, stage) for g in gaps]) / scale
            low = np.array([g.intervals.get(stage, (getattr(g, stage),) * 2)[0] for g in gaps]) / scale
            high = np.array([g.intervals.get(stage, (getattr(g, stage),) * 2)[1] for g in gaps]) / scale
            spread = np.abs(np.vstack([values - low, high - values]))
            at = np.arange(len(names)) + 0.26 * (k - 1)
            label = {"before": "before", "refit": "own numbers fitted", "after": "with what was found"}[stage]
            axes.barh(at, values, 0.24, color=colour, xerr=spread, ecolor="#444444", label=label)
        axes.axvline(1.0, color=style.BLACK, linestyle=":", linewidth=1.0)
        axes.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
        axes.invert_yaxis()
        largest = max((g.before / (g.noise or g.variation or 1.0) for g in verdict.gap.values()), default=1.0)
        if largest > 12:
            axes.set_xscale("log")
            axes.set_xlim(left=0.5)
        axes.set_xlabel("root-mean-square difference over the channel's noise (dotted: the noise itself)")
        axes.legend(loc="lower right", ncols=3)
    return figure


def located_figure(diagnosis: Diagnosis) -> Figure | None:
    """For the strongest places after the re-fit: the residual over the coordinate, or its spectrum."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from hdsim.diagnose.locate import coordinates, order_lines

    bench, stage = diagnosis.bench, diagnosis.stages[0]
    residuals = bench.residuals(diagnosis.refit.fit.predictions)
    shown: list[Place] = []
    for place in stage.location.places:
        if place.share >= 0.02 and (place.coordinate, place.channel) not in [
            (p.coordinate, p.channel) for p in shown
        ]:
            shown.append(place)
    shown = shown[:4]
    if not shown:
        return None
    with rc_context(style.STYLE):
        rows, wide = (len(shown) + 1) // 2, min(len(shown), 2)
        figure = Figure(figsize=(5.5 * wide, 3.1 * rows), layout="constrained")
        grid = figure.subplots(rows, wide, squeeze=False).ravel()
        for axes in grid[len(shown) :]:
            axes.set_axis_off()
        for axes, place in zip(grid, shown, strict=False):
            index = next(k for k, s in enumerate(bench.series) if s.channel == place.channel)
            series = bench.series[index]
            values = residuals[index]
            if place.coordinate == "wave_generator_angle":
                lines = order_lines(bench, residuals, place.channel, most=12)
                for line in lines:
                    axes.plot([line.order] * 2, [0, line.amplitude], color=style.BLUE, linewidth=2)
                axes.set_xlabel("order per wave-generator turn")
                axes.set_ylabel("amplitude")
                axes.set_ylim(bottom=0)
            else:
                where = coordinates(bench, series, residuals)
                x = where[place.coordinate]
                thin = max(1, len(x) // POINTS)
                used = np.flatnonzero(series.train)[::thin]
                axes.plot(x[used], values[used], ".", markersize=1.5, color=style.GREY, alpha=0.5)
                turned = where["direction"][used]
                halves = (turned > 0, turned < 0) if place.coordinate in _LOOPS else (turned == turned,)
                for half, colour, label in zip(
                    halves, (style.ORANGE, style.BLUE), ("motor forwards", "motor backwards"), strict=False
                ):
                    _mean_curve(axes, x[used][half], values[used][half], colour, label)
                if len(halves) == 2:
                    axes.legend(loc="best")
                axes.set_xlabel(_LABELS.get(place.coordinate, place.coordinate))
                axes.set_ylabel("measured less model")
            axes.set_title(
                f"{place.channel}: {100 * place.share:.0f} % over {place.coordinate}".replace("_", " ")
            )
    return figure


#: Coordinates over which the two directions of motion may differ.
_LOOPS = ("torque", "output_angle", "temperature")


def _mean_curve(axes: Axes, x: Array, values: Array, colour: str, label: str) -> None:
    """Draw the mean of ``values`` over bins of ``x`` that hold equally many samples."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, 31))) if len(x) > 60 else np.zeros(0)
    if len(edges) < 4:
        return
    inside = np.clip(np.searchsorted(edges, x) - 1, 0, len(edges) - 2)
    count = np.maximum(np.bincount(inside, minlength=len(edges) - 1), 1)
    mean = np.bincount(inside, values, len(edges) - 1) / count
    axes.plot(0.5 * (edges[1:] + edges[:-1]), mean, color=colour, linewidth=1.8, label=label)


_LABELS = {
    "time": "time (s)",
    "velocity": "motor velocity (rad/s)",
    "direction": "direction",
    "time_since_reversal": "direction times log(1 + time since reversal / 20 ms)",
    "output_angle": "output angle (rad)",
    "torque": "torque at the output (N m)",
    "temperature": "temperature (degC)",
}


def trace_figure(diagnosis: Diagnosis) -> Figure | None:
    """Each channel over time: what is left before and after, held-out stretches shaded."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    bench, predictions = diagnosis.bench, diagnosis.predictions
    if not predictions:
        return None
    chosen: dict[str, int] = {}
    for k, series in enumerate(bench.series):
        if series.hold.any():
            chosen.setdefault(series.channel, k)
    if not chosen:
        return None
    with rc_context(style.STYLE):
        figure = Figure(figsize=(11.0, 2.6 * len(chosen)), layout="constrained")
        grid = figure.subplots(len(chosen), 2, squeeze=False, sharex=True)
        residuals = {stage: bench.residuals(found) for stage, found in predictions.items()}
        for (left, right), (channel, k) in zip(grid, chosen.items(), strict=True):
            series = bench.series[k]
            predictor = bench.predictors[series.record]
            time = predictor.record.time
            thin = max(1, len(time) // POINTS)
            ideal = predictor.motor_angle / predictor.ratio if channel == "output_angle" else 0.0
            name = (
                "transmission error (rad)"
                if channel == "output_angle"
                else f"{channel.replace('_', ' ')} (N m)"
            )
            measured = np.where(series.train | series.hold, series.measured, np.nan) - ideal
            left.plot(time[::thin], measured[::thin], color=style.GREY, linewidth=0.8, label="measured")
            for stage, colour, label in (
                ("before", style.BLUE, "model before"),
                ("after", style.ORANGE, "model after"),
            ):
                model = series.measured - residuals[stage][k] - ideal
                left.plot(time[::thin], model[::thin], color=colour, linewidth=0.9, label=label)
                rest = np.where(series.train | series.hold, residuals[stage][k], np.nan)
                right.plot(
                    time[::thin], rest[::thin], color=colour, linewidth=0.6, label=f"measured less {label}"
                )
            left.set_title(name)
            right.set_title("what is left (shaded: held out)")
            edges = np.flatnonzero(np.diff(np.concatenate([[0], series.hold.astype(int), [0]])))
            for a, b in zip(edges[::2], edges[1::2], strict=True):
                if b - a > 20:
                    right.axvspan(time[a], time[min(b, len(time) - 1)], color="#EEEEEE", zorder=0)
        grid[0, 0].legend(loc="best")
        grid[0, 1].legend(loc="best")
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
    return figure
