"""What a fit found, as data: ``fit.json``."""

from __future__ import annotations

import math

from hdsim.estimate.estimation import Estimation
from hdsim.estimate.found import DataProblem, FittedNumber, Gap, Part, ShortCut
from hdsim.estimate.numbers import Interval


class FitNumber(FittedNumber):
    """A fitted number of a model."""

    unit: str
    """Unit of its value, empty for a pure number."""
    left: float | None = None
    """Part of its prior spread that the data leave; above 0.5 they do not determine it."""
    scales: list[str] = []
    """Numbers of the scenario that scale together with it, itself among them."""


class Correlation(Part):
    """Correlations of the numbers that were fitted."""

    names: list[str]
    """Names of rows and columns."""
    matrix: list[list[float]]
    """From -1 to 1."""


class Seen(Part):
    """A combination of numbers, in units of their prior spreads, that the data see or not."""

    spread: float
    """Ratio of the standard deviation that is left of it to the one before the data."""
    seen: bool
    """Whether the data determine it."""
    parts: dict[str, float]
    """Numbers that take part, with their share and sign."""


class RecordReading(Part):
    """What belongs to one record alone."""

    record: str
    """Its name."""
    holdout: bool
    """Whether only the proof has seen it."""
    offsets: dict[str, float]
    """Measured less predicted, mean, of each channel, in SI units."""
    locked_zero_rad: float | None = None
    """Of a locked drive the motor's angle at which it carries nothing, beside where its torques put it."""


class FitResult(Part):
    """What a fit found."""

    numbers: dict[str, FitNumber]
    """Every number that was free, by its path."""
    moved: list[str]
    """Numbers whose value in the model lies outside of their interval."""
    correlation: Correlation
    """Of the numbers that were fitted."""
    directions: list[Seen]
    """What the data see and what not, the best seen first."""
    gap: dict[str, Gap]
    """Held-out gap of each channel: before, and after the fit (``refit`` and ``after`` are the same)."""
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


def _number(interval: Interval, paths: list[str], left: float | None) -> FitNumber:
    known = interval.determined and math.isfinite(interval.low)
    return FitNumber(
        value=interval.value,
        interval=(interval.low, interval.high) if known else None,
        start=interval.start,
        tied_to=interval.tied_to,
        unit=interval.unit,
        left=left,
        scales=paths,
    )
