"""Rates, tables and bands of strength of the blind page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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


def requirements(
    measures: Callable[[Sequence[Line]], dict[str, tuple[int, int]]],
    required: Mapping[str, str],
    seconds: str,
    stated: Sequence[Line],
    others: Sequence[Line],
) -> list[str]:
    """Rates of the stated cases beside what is required, and those of the calibration cases.

    Args:
        measures: numbers of right ones and of cases, by what is asked.
        required: by the same; nothing where nothing is.
        seconds: the required processor time.
        stated: test cases.
        others: calibration cases.
    """
    there = measures(others)
    rows: list[list[Any]] = [
        [what, count, rate(right, count), required.get(what, ""), there[what][1], rate(*there[what])]
        for what, (right, count) in measures(stated).items()
    ]
    own, theirs = cpu_seconds(stated), cpu_seconds(others)
    rows.append(
        ["processor seconds: median / nine tenths / longest",
         len(own), spread(own), seconds, len(theirs), spread(theirs)]
    )  # fmt: skip
    heads = ["", "cases", "rate (95 % interval)", "required", "calibration cases", "rate there"]
    return table(heads, rows)
