"""Stated confidence against being right: expected calibration error, reliability diagram."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from judging import Line, borne_out, stated
from scipy.stats import binomtest

#: Edges of the bins; finer where most is stated.
EDGES = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


def binned(lines: Sequence[Line]) -> list[tuple[float, float, float, int, int]]:
    """Each bin that holds a case: its edges, mean stated confidence, cases that are right, cases."""
    pairs = [(stated(r), borne_out(r)) for r in lines]
    known = [(c, ok) for c, ok in pairs if c is not None]
    if not known:
        return []
    confidence = np.array([c for c, _ in known])
    right = np.array([ok for _, ok in known])
    # What is stated as exactly an edge belongs below it; 0 to the first bin.
    which = np.clip(np.searchsorted(EDGES, confidence, side="left") - 1, 0, len(EDGES) - 2)
    found = []
    for k in range(len(EDGES) - 1):
        own = which == k
        if own.any():
            found.append(
                (EDGES[k], EDGES[k + 1], float(confidence[own].mean()), int(right[own].sum()), int(own.sum()))
            )
    return found


def calibration_error(lines: Sequence[Line]) -> tuple[float, int]:
    """Expected calibration error (Naeini et al. 2015) over ``EDGES``, and the number of cases.

    The mean over cases of how far the share of right ones in a bin is from the mean confidence stated there.
    """
    bins = binned(lines)
    count = sum(n for *_, n in bins)
    away = sum(n * abs(right / n - mean) for _, _, mean, right, n in bins)
    return (away / count if count else 0.0), count


def picture(lines: Sequence[Line], path: Path) -> None:
    """The reliability diagram as a PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    bins = binned(lines)
    figure = Figure(figsize=(5.2, 5.6), layout="constrained", dpi=120)
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, height_ratios=(4, 1), sharex=True)
    upper.plot([0, 1], [0, 1], color="0.6", linestyle="--", linewidth=1, label="as stated")
    for _, _, mean, right, n in bins:
        bounds = binomtest(right, n).proportion_ci(0.95, "exact")
        share = right / n
        upper.errorbar(
            mean, share, [[share - bounds.low], [bounds.high - share]], fmt="o", color="C0", capsize=3
        )
    error, count = calibration_error(lines)
    upper.set(ylabel="share that is right", ylim=(-0.02, 1.02))
    upper.set_title(f"{count} cases, expected calibration error {100 * error:.1f} points", fontsize=10)
    upper.legend(loc="upper left", frameon=False)
    widths = [high - low for low, high, *_ in bins]
    lower.bar(
        [low for low, *_ in bins], [b[4] for b in bins], widths, align="edge", color="C0", edgecolor="w"
    )
    lower.set(xlabel="stated confidence", ylabel="cases", xlim=(-0.03, 1.03))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
