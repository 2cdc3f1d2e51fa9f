"""The verdict of a diagnosis as data: what ``verdict.json`` holds. Version 2."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from hdsim.diagnosis.decide import Reason
from hdsim.diagnosis.further import CurveFound, NextExperiment
from hdsim.estimate.found import DataProblem, FittedNumber, Gap, Part, ShortCut

VERSION = 2


class NamedEffect(Part):
    """An effect that the model was missing."""

    name: str
    """Its name in the catalogue."""
    title: str = ""
    """The field's term for it."""
    confidence: float = Field(ge=0, le=1)
    """Probability that it, or its group, is right: the odds that ``because`` adds up. The rules' own fields
    say what calibrated them."""
    chance: float = Field(ge=0, le=1)
    """Probability that the whole search finds such a share where nothing is missing."""
    explained: float
    """Cross-validated share of the residual that its trace explained when it was found."""
    parameters: dict[str, FittedNumber] = {}
    """Its fitted fields."""
    settings: dict[str, Any] = {}
    """Its fields as the scenario has them, also those that were not fitted, such as orders."""
    indistinguishable_from: list[str] = []
    """Effects that explain these data as well."""
    separated_by: dict[str, str] = {}
    """For each of them, what would tell the two apart."""


class Located(Part):
    """Where a residual lives."""

    stage: str
    """``refit``, or after which effect."""
    coordinate: str
    """Coordinate that it is a function of."""
    channel: str
    """Channel."""
    share: float
    """Cross-validated share of the channel's residual power."""
    orders: list[float] = []
    """Orders per wave-generator turn of its spectrum's peaks."""


class Remainder(Part):
    """What is left of a channel, plainly more than noise, and lives in no coordinate that the data repeat."""

    record: str
    """Name of the record."""
    channel: str
    """Channel."""
    times_noise: float
    """Root mean square of the rest over that of the noise, in the worst block of time."""
    start_s: float
    """Begin of the stretch that holds most of it."""
    end_s: float
    """Its end."""


class Verdict(Part):
    """What a diagnosis found."""

    version: int = VERSION
    """Version of this layout."""
    verdict: Literal["nothing", "parameter", "effect", "unknown"]
    """``unknown``: something is there, and no name for it is likely enough to be given."""
    sentence: str
    """The verdict in words."""
    confidence: float = Field(1.0, ge=0, le=1)
    """Probability that it is right: of the first name, or of there being none to give; calibrated."""
    effects: list[NamedEffect] = []
    """Named effects in the order in which they were found."""
    suspects: dict[str, float] = {}
    """For ``unknown``: effects that explain a part, with the share, none likely enough to be named."""
    parameters: dict[str, FittedNumber] = {}
    """The base model's own numbers, fitted."""
    moved: list[str] = []
    """Those whose start value lies outside their interval; where there is none although the re-fit closes a
    gap, those that would do so alone."""
    gap: dict[str, Gap] = {}
    """By channel."""
    located: list[Located] = []
    """Strongest places first within each stage."""
    data_problems: list[DataProblem] = []
    """What the data check found."""
    not_tried: dict[str, str] = {}
    """Effects of the catalogue that could not be tried, with the reason."""
    curve: CurveFound | None = None
    """What is left as a curve over the coordinate that explains it best: for ``unknown`` all of it, and the
    scenario has it; beside names what they leave, and the scenario has it not."""
    remainder: Remainder | None = None
    """For ``unknown``: what is left without a place, as what happens once."""
    because: list[Reason] = []
    """Every rule that was asked, with what was seen: of a name (``of``) what each piece of evidence adds to
    the logarithm of its odds and the probability that comes out; of the whole, limits."""
    next_experiment: NextExperiment | None = None
    """What to measure next, where these data leave names that they cannot tell apart."""
    scenario: str | None = None
    """The scenario that extends the base with what was found."""
    readings: int = 1
    """Successive readings whose means were compared, of the record that was read fastest; all numbers, gaps
    and their noise are of these means."""
    short_cut: ShortCut | None = None
    """How predictions with teeth were made; null without teeth."""
    seconds: dict[str, float] = {}
    """Processor time spent in each step, s."""
