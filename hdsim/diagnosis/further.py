"""What a verdict offers beyond names: an unnamed effect's curve, and the next experiment. Fields only."""

from __future__ import annotations

from hdsim.estimate.found import Part


class CurveFound(Part):
    """A curve that explains what nothing in the catalogue does; in the scenario it is a ``table`` effect."""

    words: str
    """What it is over what, in words."""
    coordinate: str
    """Coordinate, as the ``table`` effect names it."""
    coordinate_unit: str
    """Unit of the coordinate."""
    acts_on: str
    """What it acts on, as the ``table`` effect names it."""
    times_direction: bool = False
    """Whether it turns its sign with the direction of motion."""
    period: float | None = None
    """Length after which it repeats, in the coordinate's unit."""
    at: list[float]
    """Corners."""
    values: list[float]
    """Value at each corner."""
    intervals: list[tuple[float, float]]
    """95 % interval of each value. What the model's own numbers could explain as well, such as a constant, is
    left out of curve and interval."""
    unit: str
    """Unit of the values."""
    share: float
    """Cross-validated share of the weighed residual that it explains."""
    tried: dict[str, float] = {}
    """That share of every curve that was tried, by its words."""


class Candidate(Part):
    """A scenario that was considered as the next experiment."""

    title: str
    """What is done."""
    separation: float
    """d' between the two candidates that it separates worst: the distance between their records, each fitted
    to the other as well as it can be, in standard deviations of the noise."""
    relative: float
    """That number over the one of a repetition of the measured record."""


class NextExperiment(Part):
    """The experiment that would separate what these data cannot tell apart."""

    sentence: str
    """What to do and what to look for."""
    between: list[str]
    """The candidates that it separates."""
    separation: float
    """Its expected d' between the two that it separates worst."""
    repeated: float
    """The same for a repetition of the measured record."""
    correct: float
    """Expected share of right decisions between those two if the noise were all that is unknown."""
    considered: list[Candidate]
    """Every scenario that was simulated, best first."""
    scenario: str | None = None
    """File of the scenario."""
