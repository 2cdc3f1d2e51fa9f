"""What a fit found, as data: ``fit.json``."""

from __future__ import annotations

import math
from typing import Literal

from hdsim.estimate.estimation import Estimation
from hdsim.estimate.found import DataProblem, Gap, ParameterEstimate, Part, ShortCut
from hdsim.estimate.numbers import Interval


class FitParameter(ParameterEstimate):
    """An estimated parameter of a model."""

    unit: str
    """Unit of its value, empty for a pure number."""
    posterior_over_prior: float | None = None
    """Standard deviation after the data over that before; above 0.5 it is not identifiable."""
    scales: list[str] = []
    """Parameters of the scenario that scale together with it, itself among them."""


class Correlation(Part):
    """Correlations of the estimates."""

    names: list[str]
    """Names of rows and columns."""
    matrix: list[list[float]]
    """From -1 to 1."""


class Seen(Part):
    """A combination of parameters, in units of their prior spreads, and whether it is identifiable."""

    spread: float
    """Ratio of its standard deviation after the data to that before."""
    seen: bool
    """Whether the data determine it."""
    parts: dict[str, float]
    """Parameters that take part, with their share and sign."""


class RecordReading(Part):
    """What belongs to one record alone."""

    record: str
    """Its name."""
    holdout: bool
    """Whether it is a validation record."""
    offsets: dict[str, float]
    """Measured less predicted, mean, of each channel, in SI units."""
    locked_zero_rad: float | None = None
    """Of a locked drive the motor's angle at which it carries nothing, beside where its torques put it."""


class FitResult(Part):
    """What a fit found."""

    numbers: dict[str, FitParameter]
    """Every free parameter, by its path."""
    estimated_from: Literal["training", "all"] = "training"
    """Data that they are of: ``all`` includes the held-out stretches, which had judged the model before."""
    moved: list[str]
    """Parameters whose interval excludes the model's value."""
    correlation: Correlation
    """Of the estimates."""
    directions: list[Seen]
    """Identifiable and not identifiable combinations, the best determined first."""
    gap: dict[str, Gap]
    """Held-out RMS residual of each channel, before and after the fit (``refit`` equals ``after``)."""
    records: list[RecordReading]
    """Offsets and zeros of each record."""
    data_problems: list[DataProblem] = []
    """What is wrong with the data."""
    short_cut: ShortCut | None = None
    """How predictions with teeth were made; null without teeth."""
    scenario: str = ""
    """The fitted scenario's file."""


def result_of(found: Estimation) -> FitResult:
    """What ``fit.json`` holds."""
    paths = {free.name: list(free.paths) for free in found.refit.freedoms}
    return FitResult(
        numbers={i.name: _number(i, paths.get(i.name, []), found.left.get(i.name)) for i in found.intervals},
        estimated_from=found.estimated_from,
        moved=found.moved,
        correlation=Correlation(names=found.names, matrix=found.correlation.round(4).tolist()),
        directions=[Seen(spread=d.spread, seen=d.seen, parts=d.parts) for d in found.directions],
        gap=found.gap,
        records=[
            RecordReading(record=r.record, holdout=r.held, offsets=r.offsets, locked_zero_rad=r.zero)
            for r in found.readings
        ],
        data_problems=[DataProblem(**vars(problem)) for problem in found.problems],
        short_cut=found.short_cut,
    )


def _number(interval: Interval, paths: list[str], left: float | None) -> FitParameter:
    known = interval.determined and math.isfinite(interval.low)
    return FitParameter(
        value=interval.value,
        interval=(interval.low, interval.high) if known else None,
        start=interval.start,
        tied_to=interval.tied_to,
        unit=interval.unit,
        posterior_over_prior=left,
        scales=paths,
    )
