"""What a study says: means and quantiles with confidence intervals, at every combination of stated values."""

from __future__ import annotations

import csv
import json
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
    mean: Interval
    standard_deviation: float
    median: float
    low: float
    high: Interval
    least: float
    largest: float


def mean_interval(values: Array, confidence: float) -> Interval:
    """Mean with Student's t interval (values that are not normal: right for many, by the central limit)."""
    mean = float(np.mean(values)) if len(values) else np.nan
    if len(values) < 2:
        return Interval(mean, np.nan, np.nan)
    from scipy import stats

    half = float(stats.t.ppf(0.5 + confidence / 2, len(values) - 1) * stats.sem(values))
    return Interval(mean, mean - half, mean + half)


def quantile_interval(values: Array, share: float, confidence: float) -> Interval:
    """Quantile with the percentile interval of the bootstrap (Efron and Tibshirani 1993)."""
    value = float(np.quantile(values, share)) if len(values) else np.nan
    if len(values) < 2:
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


def summarise(plan: Plan, table: StudyTable) -> list[MetricSummary]:
    """Every metric at every combination of stated values, over samples and replicates."""
    points = np.array(table.columns["point"].values)
    names = list(plan.study.factors)
    found = []
    for metric in plan.metrics:
        values = table.values(metric.name)
        for point in np.unique(points):
            here = points == point
            first = int(np.flatnonzero(here)[0])
            good = values[here & np.isfinite(values)]
            nothing = not len(good)
            found.append(
                MetricSummary(
                    metric.name,
                    metric.unit,
                    {name: table.columns[name].values[first] for name in names},
                    len(good),
                    int(here.sum()) - len(good),
                    mean_interval(good, plan.study.confidence),
                    float(np.std(good, ddof=1)) if len(good) > 1 else np.nan,
                    np.nan if nothing else float(np.median(good)),
                    np.nan if nothing else float(np.quantile(good, 0.05)),
                    quantile_interval(good, 0.95, plan.study.confidence),
                    np.nan if nothing else float(good.min()),
                    np.nan if nothing else float(good.max()),
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
        writer.writerow(["metric", "unit", *names, "runs", "failed", "mean", *interval, *spread])
        for s in summaries:
            numbers = [s.mean.value, s.mean.low, s.mean.high, s.standard_deviation, s.median, s.low]
            numbers += [s.high.value, s.high.low, s.high.high, s.least, s.largest]
            point = [v if isinstance(v, str | int | float) else json.dumps(v) for v in s.point.values()]
            writer.writerow(
                [s.metric, s.unit, *point, s.runs, s.failed, *("" if np.isnan(x) else x for x in numbers)]
            )
    return path
