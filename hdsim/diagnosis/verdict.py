"""The verdict of a diagnosis as data: what ``verdict.json`` holds. Version 2."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from hdsim.diagnosis.decide import Reason
from hdsim.diagnosis.further import CurveFound, NextExperiment
from hdsim.diagnosis.growth import TrackedOrder
from hdsim.estimate.found import DataProblem, Gap, ParameterEstimate, Part, ShortCut

VERSION = 2


class IdentifiedEffect(Part):
    """An effect that the model was missing."""

    name: str
    """Its key in the catalogue."""
    title: str = ""
    """The field's term for it."""
    confidence: float = Field(ge=0, le=1)
    """Probability that it, or its group, is right: the odds that ``because`` adds up. The rules' own fields
    say what calibrated them."""
    chance: float = Field(ge=0, le=1)
    """p-value: probability that the whole search finds such a share where nothing is missing."""
    explained: float
    """Cross-validated share of the residual that it explained when it was found."""
    parameters: dict[str, ParameterEstimate] = {}
    """Estimates of its parameters."""
    settings: dict[str, Any] = {}
    """Its fields as the scenario has them, also those that were not fitted, such as orders."""
    indistinguishable_from: list[str] = []
    """Effects that explain these data as well."""
    separated_by: dict[str, str] = {}
    """For each of them, what would distinguish the two."""


class Located(Part):
    """What a residual depends on."""

    stage: str
    """``refit``, or after which effect."""
    coordinate: str
    """Regressor that it is a function of."""
    channel: str
    """Channel."""
    share: float
    """Cross-validated share of the channel's residual power."""
    orders: list[float] = []
    """Orders per wave-generator turn of its spectrum's peaks."""


class Remainder(Part):
    """A residual of a channel, plainly above the noise, that is a function of no regressor repeatably."""

    record: str
    """Name of the record."""
    channel: str
    """Channel."""
    times_noise: float
    """RMS residual over that of the noise, in the worst block of time."""
    start_s: float
    """Begin of the stretch that holds most of it."""
    end_s: float
    """Its end."""


class Remains(Part):
    """What identified effects leave of the systematic residual, more than chance would."""

    share: float
    """Part of the re-fitted model's systematic residual."""
    coordinate: str
    """Regressor that it depends on most."""


class TeethFound(Part):
    """What the named effects mean in the drive's teeth."""

    sentences: list[str] = []
    """All of it in words."""
    member: str = ""
    """Spline that a single tooth belongs to."""
    tooth: ParameterEstimate | None = None
    """Its number, from the tooth on the wave generator's lobe at zero angles."""
    opposite: float | None = None
    """The tooth half a turn on, which these data cannot tell from it."""
    or_member: str = ""
    """The other spline, where a tooth of it explains the data as well; else empty."""
    or_tooth: ParameterEstimate | None = None
    """The number of that tooth."""
    half_gap_um: ParameterEstimate | None = None
    """Mean half-gap of the teeth."""
    roughness_m: dict[str, float] = {}
    """Fractal roughness G that leaves it, by spline, where the model has no teeth."""
    scenario: str | None = None
    """The scenario of the drive whose teeth have the play that was found."""


class Verdict(Part):
    """What a diagnosis found."""

    version: int = VERSION
    """Version of this layout."""
    verdict: Literal["nothing", "parameter", "effect", "unknown"]
    """``unknown``: the residual is systematic, and no effect is probable enough to be identified."""
    sentence: str
    """The verdict as a sentence."""
    confidence: float = Field(1.0, ge=0, le=1)
    """Probability that it is right: of the first effect, or of there being none; calibrated."""
    effects: list[IdentifiedEffect] = []
    """Identified effects in the order in which they were found."""
    suspects: dict[str, float] = {}
    """For ``unknown``: effects that explain a part, with the share, none probable enough to be identified."""
    parameters: dict[str, ParameterEstimate] = {}
    """Estimates of the base model's parameters."""
    estimated_from: Literal["training", "all"] = "training"
    """Data that the estimates, also those of effects, are of: ``all`` includes the held-out stretches, which
    had judged the model before. Residuals are always of the estimates from training data."""
    moved: list[str] = []
    """Those whose interval excludes the base model's value; where the re-fit reduces a held-out residual and
    they do not explain most of what it changed, those that would do so alone."""
    gap: dict[str, Gap] = {}
    """Held-out RMS residuals by channel."""
    located: list[Located] = []
    """Strongest regressors first within each stage."""
    orders: list[TrackedOrder] = []
    """The located orders over speed: which grow with it, and their amplitudes in each record."""
    data_problems: list[DataProblem] = []
    """What the data check found."""
    not_tried: dict[str, str] = {}
    """Effects of the catalogue that could not be tested, with the reason."""
    curve: CurveFound | None = None
    """The residual as a curve over the regressor that explains it best: for ``unknown`` all of it, and part
    of the scenario; beside identified effects what they do not explain (see ``scenario_with_curve``)."""
    remains: Remains | None = None
    """Beside identified effects: what they leave, where it is more than chance."""
    remainder: Remainder | None = None
    """For ``unknown``: a residual that depends on no regressor, as what happens once."""
    because: list[Reason] = []
    """Every rule that was applied, with the observed value: of an effect (``of``) what each piece of evidence
    adds to the logarithm of its odds and the resulting probability; of the whole, thresholds."""
    next_experiment: NextExperiment | None = None
    """What to measure next, where these data cannot distinguish effects."""
    teeth: TeethFound | None = None
    """What the named effects mean in the drive's teeth, where they say anything of them."""
    scenario: str | None = None
    """The scenario that extends the base with the result."""
    scenario_with_curve: str | None = None
    """Beside identified effects: the scenario that has the curve of what they leave, too, where held-out data
    bear it out."""
    readings: int = 1
    """Successive readings whose means were compared, of the record that was read fastest; all numbers, gaps
    and their noise are of these means."""
    short_cut: ShortCut | None = None
    """How predictions with teeth were made; null without teeth."""
    seconds: dict[str, float] = {}
    """Processor time spent in each step, s."""

    @property
    def moved_parameters(self) -> dict[str, ParameterEstimate]:
        """The estimates of those that moved, in that order."""
        return {name: self.parameters[name] for name in self.moved if name in self.parameters}
