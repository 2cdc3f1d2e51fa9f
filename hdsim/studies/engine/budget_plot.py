"""The picture of an error budget."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hdsim.studies.engine.budget import POSITIONING, Budget

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_budget(budget: Budget) -> Figure:
    """Waterfall: from the rest over every cause to the whole."""
    from hdsim.plot import style
    from hdsim.studies.engine.plots import page

    name = budget.error.replace("_", " ")
    shared = all(part.share is not None for part in budget.parts)
    rows: list[tuple[str, float, str]] = [
        (part.cause.title, part.removed if part.share is None else part.share.value, style.BLUE)
        for part in budget.parts
    ]
    if shared:
        bars = "Bars: Shapley's shares, what a cause adds, mean over all orders of switching the causes on"
    else:
        bars = f"Bars: how much the {name} changes when one cause is switched off"
        rows.append(("interaction", budget.interaction, style.GREY))
    rows.append(("rest (all off)", budget.rest, style.GREY))
    about = (
        f"{bars}; they add up to the whole. Ring: the cause alone, all others off; far from its bar's "
        f"length, the causes work together."
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
