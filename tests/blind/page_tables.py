"""Rates, tables and bands of strength of the blind page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from judging import Line
from scipy.stats import binomtest

#: Bands of strength: they meet at the middle, in logarithm, between the strengths that are asked for.
BANDS = ((0.5, 1.5), (1.5, 3.5), (3.5, 10.0), (10.0, 35.0), (35.0, 100.0))


def rate(right: int, count: int) -> str:
    """A rate with its Clopper-Pearson 95 % interval, in words."""
    if count == 0:
        return "-"
    bounds = binomtest(right, count).proportion_ci(0.95, "exact")
    return f"{100 * right / count:.0f} % ({100 * bounds.low:.0f} to {100 * bounds.high:.0f})"


def table(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    """A Markdown table."""
    if not rows:
        return ["None."]
    cells = [[str(cell).replace("|", "/").replace("\n", " ") for cell in row] for row in rows]
    lines = [" | ".join(row) for row in ([*heads], ["---"] * len(heads), *cells)]
    return [f"| {line} |" for line in lines]


def band(line: Line) -> str:
    """Band of the strength of what is hidden least visibly."""
    if not line["strength"] or line["kind"] in ("null", "parameter"):
        return "-"
    weakest = min(line["strength"])
    for low, high in BANDS:
        # What was not quite reached, or passed, belongs to the end bands.
        if weakest < high or high == BANDS[-1][1]:
            return f"{low:g} to {high:g}"
    raise AssertionError


def cpu_seconds(lines: Sequence[Line]) -> list[float]:
    """Processor seconds of the cases that say them."""
    return [float(r["cpu_s"]) for r in lines if "cpu_s" in r]


def spread(spent: Sequence[float]) -> str:
    """Median, nine tenths and longest."""
    if not spent:
        return "-"
    return f"{np.median(spent):.0f} / {np.quantile(spent, 0.9):.0f} / {max(spent):.0f}"
