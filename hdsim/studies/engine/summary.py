"""What a study says: means and quantiles with confidence intervals, at every combination of stated values."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.studies.engine.reading import Plan
from hdsim.studies.engine.table import StudyTable

Array = NDArray[np.float64]

#: Resamples of the bootstrap.
RESAMPLES = 1999


@dataclass(frozen=True)
class Interval:
    """An estimate with its confidence interval; the ends are NaN with fewer than two values."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class MetricSummary:
    """One metric over the runs of one combination of stated values.

    Args:
        metric: name.
        unit: of the values.
        point: the stated values by parameter.
        runs: number of runs that gave a value.
        failed: number that did not.
        never: number of these values that are infinite: a time that never comes.
        difference: mean difference to the first combination on the same drives, with Student's t interval of
            the paired differences; NaN at the first, and where no two combinations meet the same drives.
        pairs: number of drives with a finite value at both.
        mean: mean, with Student's t interval.
        standard_deviation: with n - 1.
        median: median.
        low: 5 % quantile.
        high: 95 % quantile, with bootstrap interval.
        least: smallest value.
        largest: largest value.
    """

    metric: str
    unit: str
    point: dict[str, Any]
    runs: int
    failed: int
    never: int
    mean: Interval
    standard_deviation: float
    median: float
    low: float
    high: Interval
    least: float
    largest: float
    difference: Interval
    pairs: int


def mean_interval(values: Array, confidence: float) -> Interval:
    """Mean with Student's t interval (values that are not normal: right for many, by the central limit)."""
    mean = float(np.mean(values)) if len(values) else np.nan
    if len(values) < 2 or np.isinf(mean):
        return Interval(mean, np.nan, np.nan)
    from scipy import stats

    half = float(stats.t.ppf(0.5 + confidence / 2, len(values) - 1) * stats.sem(values))
    return Interval(mean, mean - half, mean + half)


def quantile_interval(values: Array, share: float, confidence: float) -> Interval:
    """Quantile with the percentile interval of the bootstrap (Efron and Tibshirani 1993)."""
    value = _quantile(values, share)
    if len(values) < 2 or np.isinf(values).any():
        return Interval(value, np.nan, np.nan)
    from scipy import stats

    found = stats.bootstrap(
        (values,),
        lambda sample, axis: np.quantile(sample, share, axis=axis),
        confidence_level=confidence,
        n_resamples=RESAMPLES,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Interval(value, float(found.low), float(found.high))


def _quantile(values: Array, share: float) -> float:
    """Quantile, linear between two values and infinite beyond the last finite one; NaN of nothing."""
    if not len(values):
        return np.nan
    if np.isfinite(values).all():
        return float(np.quantile(values, share))
    place = share * (len(values) - 1)
    low, high = np.sort(values)[[int(place), math.ceil(place)]]
    return float(low if low == high else low + (place % 1.0) * (high - low))


def paired_difference(values: Array, first: Array, confidence: float) -> tuple[Interval, int]:
    """Mean of values less those of the same drives at the first point, with Student's t interval.

    On the same drives what they have in common cancels, so the interval is that of the parameters' effect
    (common random numbers: Law 2015, Simulation Modeling and Analysis, 11.2, the paired-t interval).

    Args:
        values: of the drives, shape (n,); NaN or infinite where there is none.
        first: of the same drives at the first point, shape (n,).
        confidence: of the interval.

    Returns:
        The difference, and the number of pairs.
    """
    both = np.isfinite(values) & np.isfinite(first)
    return mean_interval(values[both] - first[both], confidence), int(both.sum())


def summarise(plan: Plan, table: StudyTable) -> list[MetricSummary]:
    """Every metric at every combination of stated values, over samples and replicates."""
    points = np.array(table.columns["point"].values)
    names = list(plan.study.factors)
    found = []
    for metric in plan.metrics:
        values = table.values(metric.name)
        whole = len(table) == len(plan.runs)
        for point in np.unique(points):
            here = points == point
            first = int(np.flatnonzero(here)[0])
            good = values[here & ~np.isnan(values)]
            nothing = not len(good)
            difference, pairs = Interval(np.nan, np.nan, np.nan), 0
            if plan.study.paired and whole and point != points[0]:
                # The runs of every point are in the same order of drives.
                at_first = values[points == points[0]]
                difference, pairs = paired_difference(values[here], at_first, plan.study.confidence)
            found.append(
                MetricSummary(
                    metric.name,
                    metric.unit,
                    {name: table.columns[name].values[first] for name in names},
                    len(good),
                    int(here.sum()) - len(good),
                    int(np.isinf(good).sum()),
                    mean_interval(good, plan.study.confidence),
                    float(np.std(good, ddof=1)) if len(good) > 1 and np.isfinite(good).all() else np.nan,
                    _quantile(good, 0.5),
                    _quantile(good, 0.05),
                    quantile_interval(good, 0.95, plan.study.confidence),
                    np.nan if nothing else float(good.min()),
                    np.nan if nothing else float(good.max()),
                    difference,
                    pairs,
                )
            )
    return found


def write_summary(summaries: list[MetricSummary], path: Path, confidence: float) -> Path:
    """Write summaries as CSV."""
    percent = f"{confidence:.4g}".removeprefix("0.")
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = list(summaries[0].point) if summaries else []
        interval = [f"mean_low_{percent}", f"mean_high_{percent}"]
        upper = [f"q95_low_{percent}", f"q95_high_{percent}"]
        spread = ["standard_deviation", "median", "q05", "q95", *upper, "least", "largest"]
        paired = ["difference", f"difference_low_{percent}", f"difference_high_{percent}", "pairs"]
        writer.writerow(
            ["metric", "unit", *names, "runs", "failed", "never", "mean", *interval, *spread, *paired]
        )
        for s in summaries:
            numbers = [s.mean.value, s.mean.low, s.mean.high, s.standard_deviation, s.median, s.low]
            numbers += [s.high.value, s.high.low, s.high.high, s.least, s.largest]
            numbers += [s.difference.value, s.difference.low, s.difference.high]
            point = [v if isinstance(v, str | int | float) else json.dumps(v) for v in s.point.values()]
            writer.writerow(
                [
                    *(s.metric, s.unit, *point, s.runs, s.failed, s.never),
                    *("" if np.isnan(x) else x for x in numbers),
                    s.pairs,
                ]
            )
    return path
