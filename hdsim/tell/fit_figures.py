"""Figures of a fit: confidence intervals, correlations of the estimates, residuals of the channels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.estimate.estimation import Estimation
from hdsim.plot import style, units
from hdsim.tell.figures import AFTER, BEFORE, MODELS, POINTS, WIDTH, legend_above
from hdsim.tell.words import named_number, spoken

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def intervals_figure(found: Estimation) -> Figure | None:
    """Each identifiable parameter over the model's value, with its 95 % interval."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    shown = [i for i in found.intervals if i.determined and i.start > 0]
    if not shown:
        return None
    with rc_context(style.STYLE):
        figure = Figure(figsize=(WIDTH, 0.9 + 0.34 * len(shown)), layout="constrained")
        axes = figure.subplots()
        axes.axvline(1.0, color="#888888", linewidth=1.0)
        for k, one in enumerate(shown):
            value, low, high = (v / one.start for v in (one.value, one.low, one.high))
            axes.plot([low, high], [k, k], color=AFTER, linewidth=2.2, solid_capstyle="butt")
            axes.plot(value, k, "o", color=AFTER if not one.moved else style.ORANGE, markersize=6)
        values = np.array([[i.low / i.start, i.high / i.start] for i in shown])
        if values.max() / values.min() > 4.0:
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter("{x:g}")
        axes.set_yticks(range(len(shown)), [named_number(i.name)[0] for i in shown])
        axes.set_ylim(len(shown) - 0.5, -0.5)
        axes.grid(visible=False, axis="y")
        axes.set_xlabel("estimate / model value (95 % interval; orange: model value outside)")
    return figure


def correlation_figure(found: Estimation) -> Figure | None:
    """The correlation matrix of the estimates."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    n = len(found.names)
    if n < 2:
        return None
    with rc_context(style.STYLE):
        figure = Figure(figsize=(WIDTH, 1.6 + 0.42 * n), layout="constrained")
        axes = figure.subplots()
        picture = axes.imshow(found.correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0, aspect="auto")
        for j in range(n):
            for k in range(n):
                value = found.correlation[j, k]
                colour = "white" if abs(value) > 0.6 else "#222222"
                axes.text(k, j, f"{value:.2f}", ha="center", va="center", fontsize=9, color=colour)
        words = [named_number(name)[0] for name in found.names]
        axes.set_yticks(range(n), words)
        axes.set_xticks(range(n), words, rotation=25, ha="right")
        axes.grid(visible=False)
        figure.colorbar(picture, ax=axes, fraction=0.03)
    return figure


def left_figure(found: Estimation) -> Figure | None:
    """Residuals of the model as given and as fitted, of each channel of the first held-out record."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    bench = found.bench
    chosen: dict[str, int] = {}
    for k, series in enumerate(bench.series):
        if series.hold.any():
            chosen.setdefault(series.channel, k)
    if not chosen:
        return None
    residuals = {
        stage: bench.residuals(found.predictions[stage], drift=True) for stage in ("before", "after")
    }
    with rc_context(style.STYLE):
        figure = Figure(figsize=(WIDTH, 0.6 + 1.5 * len(chosen)), layout="constrained")
        grid = figure.subplots(len(chosen), 1, squeeze=False)[:, 0]
        for axes, (channel, k) in zip(grid, chosen.items(), strict=True):
            series = bench.series[k]
            record = bench.predictors[series.record].record
            good = series.train | series.hold
            thin = max(1, len(record.time) // POINTS)
            size = units.largest(*(residuals[stage][k][good] for stage in residuals))
            unit = units.for_error(size) if channel.endswith("angle") else units.for_torque(size)
            for stage, colour in (("before", BEFORE), ("after", AFTER)):
                rest = np.where(good, unit.factor * residuals[stage][k], np.nan)
                axes.plot(record.time[::thin], rest[::thin], color=colour, linewidth=0.8, label=MODELS[stage])
            axes.fill_between(
                record.time, 0, 1, where=series.hold, transform=axes.get_xaxis_transform(),
                color="#EFEFEF", zorder=0, linewidth=0,
            )  # fmt: skip
            axes.set_xlim(record.time[0], record.time[-1])
            axes.set_title(f"{spoken(channel)}: residual ({unit.name}), {record.name}")
        legend_above(grid[0])
        grid[-1].set_xlabel("time (s)")
    return figure
