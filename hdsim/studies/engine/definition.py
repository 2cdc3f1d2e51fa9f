"""What a user says about a study: the base, the parameters that vary, how they are sampled, the metrics."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hdsim.parts import Parameters

Value = bool | int | float | str | None


def _or_text(schema: dict[str, Any]) -> None:
    """For editors: the file may have one text here, which the reader makes into what is wanted."""
    own = {key: schema.pop(key) for key in ("type", "items", "minItems", "anyOf") if key in schema}
    schema["anyOf"] = [*own.pop("anyOf", [own]), {"type": "string"}]


class Base(Parameters):
    """What every run starts from: a scenario, or a bench procedure applied to a drive."""

    scenario: dict[str, Any] | None = Field(None, json_schema_extra=_or_text)
    """A scenario: the path of its file, or written here (it may extend a file)."""
    procedure: str | None = None
    """Name of a bench procedure; given instead of a scenario."""
    drive: dict[str, Any] | None = None
    """Section ``drive`` for the procedure."""
    effects: dict[str, Any] | None = None
    """Section ``effects`` for the procedure; the procedure's own choice when left out."""
    run: dict[str, Any] | None = None
    """Fields of the section ``run`` that replace the procedure's own."""
    options: dict[str, Any] = {}
    """The procedure's own options."""

    @model_validator(mode="after")
    def _one_of_two(self) -> Base:
        if (self.scenario is None) == (self.procedure is None):
            raise ValueError("found both or none of scenario and procedure, expected exactly one of them")
        if self.procedure is not None and self.drive is None:
            raise ValueError("found a procedure without drive, expected drive: {preset: ...}")
        if self.scenario is not None:
            extra = [name for name in ("drive", "effects", "run", "options") if getattr(self, name)]
            if extra:
                raise ValueError(
                    f"found {', '.join(extra)} beside scenario, expected them inside the scenario"
                )
        return self


class ValueList(Parameters):
    """The values themselves: numbers, text, true/false, null (which turns an effect off) or
    whole sections.
    """

    type: Literal["list"]
    values: list[Value | dict[str, Any]] = Field(min_length=1)
    """The values."""


class Grid(Parameters):
    """Evenly spaced values."""

    type: Literal["grid"]
    start: float
    """First value."""
    stop: float
    """Last value."""
    points: int = Field(ge=2, le=100_000)
    """Number of values."""
    spacing: Literal["linear", "logarithmic"] = "linear"
    """Equal differences, or equal ratios."""

    @model_validator(mode="after")
    def _logarithm_exists(self) -> Grid:
        if self.spacing == "logarithmic" and (self.start <= 0 or self.stop <= 0):
            raise ValueError(
                f"logarithmic spacing needs start and stop above 0, found {self.start}, {self.stop}"
            )
        return self


class _Interval(Parameters):
    low: float
    """Lower end."""
    high: float
    """Upper end."""

    @model_validator(mode="after")
    def _ordered(self) -> _Interval:
        if not self.low < self.high:
            raise ValueError(f"low must lie below high, found {self.low} and {self.high}")
        return self


class Uniform(_Interval):
    """Every value between two ends is equally likely."""

    type: Literal["uniform"]


class LogUniform(_Interval):
    """Every ratio is equally likely: the logarithm is uniform."""

    type: Literal["loguniform"]

    @model_validator(mode="after")
    def _positive(self) -> LogUniform:
        if self.low <= 0:
            raise ValueError(f"low must exceed 0, found {self.low}")
        return self


class Triangular(_Interval):
    """Rises linearly from low to mode and falls to high."""

    type: Literal["triangular"]
    mode: float
    """Most likely value."""

    @model_validator(mode="after")
    def _mode_inside(self) -> Triangular:
        if not self.low <= self.mode <= self.high:
            raise ValueError(f"mode must lie between low and high, found {self.mode}")
        return self


class Normal(Parameters):
    """Gaussian; ``low`` and ``high`` cut it (and the rest is scaled up to 1)."""

    type: Literal["normal"]
    mean: float
    """Mean before cutting."""
    standard_deviation: float = Field(gt=0)
    """Standard deviation before cutting."""
    low: float = -math.inf
    """Values below are left out."""
    high: float = math.inf
    """Values above are left out."""

    model_config = {"allow_inf_nan": True}

    @model_validator(mode="after")
    def _ordered(self) -> Normal:
        if not self.low < self.high:
            raise ValueError(f"low must lie below high, found {self.low} and {self.high}")
        return self


class LogNormal(Parameters):
    """The logarithm is Gaussian."""

    type: Literal["lognormal"]
    median: float = Field(gt=0)
    """Median: half of the values lie below."""
    geometric_standard_deviation: float = Field(gt=1)
    """Factor s: 68 % of the values lie between median / s and median * s."""


Distribution = Uniform | LogUniform | Triangular | Normal | LogNormal
Variation = Annotated[
    ValueList | Grid | Uniform | LogUniform | Triangular | Normal | LogNormal, Field(discriminator="type")
]


class RandomSampling(Parameters):
    """Independent random samples of the distributions."""

    type: Literal["random"]
    samples: int = Field(ge=1, le=1_000_000)
    """Number of samples."""


class LatinHypercube(Parameters):
    """Every distribution is cut into as many equally likely slices as there are samples; each
    is used once.
    """

    type: Literal["latin_hypercube"]
    samples: int = Field(ge=1, le=1_000_000)
    """Number of samples."""


class SobolSequence(Parameters):
    """Scrambled Sobol sequence: low discrepancy, best with a power of two."""

    type: Literal["sobol_sequence"]
    samples: int = Field(ge=1, le=1_000_000)
    """Number of samples; a power of two keeps the sequence balanced."""


class SobolIndices(Parameters):
    """Saltelli's design for Sobol's variance-based sensitivity indices (SALib)."""

    type: Literal["sobol_indices"]
    base_samples: int = Field(ge=2, le=1_000_000)
    """Base samples N, a power of two; the study has N (parameters + 2) runs."""

    @model_validator(mode="after")
    def _power_of_two(self) -> SobolIndices:
        if self.base_samples & (self.base_samples - 1):
            raise ValueError(f"base_samples must be a power of two, found {self.base_samples}")
        return self


class Morris(Parameters):
    """Morris's elementary effects (SALib): a first screening of many parameters."""

    type: Literal["morris"]
    trajectories: int = Field(10, ge=2, le=100_000)
    """Trajectories r; the study has r (parameters + 1) runs."""
    levels: int = Field(4, ge=2, le=100)
    """Levels of every parameter, even."""

    @model_validator(mode="after")
    def _even(self) -> Morris:
        if self.levels % 2:
            raise ValueError(f"levels must be even, found {self.levels}")
        return self


Sampling = Annotated[
    RandomSampling | LatinHypercube | SobolSequence | SobolIndices | Morris, Field(discriminator="type")
]


class Study(Parameters):
    """A base, what varies in it, and what is measured."""

    name: str = Field("", max_length=200)
    """Name of the study; the file's name when left out."""
    description: str = Field("", max_length=10_000)
    """What the study is to find out."""
    base: Base
    """Scenario or bench procedure from which every run starts."""
    parameters: dict[str, Variation] = {}
    """What varies, by the dotted name of a scenario's field."""
    sampling: Sampling | None = None
    """How the parameters with a distribution are sampled; all of them jointly."""
    replicates: int = Field(1, ge=1, le=1_000_000)
    """Drives with other random tooth surfaces and noise at every point of the design; the first is the
    base's own (``run.seed``)."""
    surfaces: Literal["common", "population", "independent"] | None = None
    """Which runs have the same drive. ``common``: replicate k is one drive, whatever else varies.
    ``population``: every sample of the distributions is a drive of its own, the same at all stated values.
    ``independent``: no two runs. Left out: common, or population where distributions are
    sampled at random."""
    seed: int = Field(0, ge=0, lt=2**63)
    """Seed of the samples and of the drives after the base's own."""
    metrics: list[str] = Field(min_length=1, json_schema_extra=_or_text)
    """Names of the metrics that are taken of every run."""
    keep_logs: bool = False
    """Keep the MCAP log of every run."""
    confidence: float = Field(0.95, gt=0.5, lt=1)
    """Confidence of the summary's intervals."""

    @model_validator(mode="after")
    def _sampling_fits(self) -> Study:
        random = self.distributions
        if random and self.sampling is None:
            raise ValueError(
                f"{', '.join(random)} has a distribution, so the study needs "
                f"sampling: {{type: ..., samples: ...}}"
            )
        if self.sampling is not None and not random:
            raise ValueError(
                "found sampling, but no parameter has a distribution (for other surfaces: replicates)"
            )
        if isinstance(self.sampling, SobolIndices | Morris) and self.factors:
            raise ValueError(
                f"sensitivity indices need a distribution for every parameter, "
                f"found list or grid for {', '.join(self.factors)}"
            )
        if len(set(self.metrics)) < len(self.metrics):
            raise ValueError("found a metric twice")
        return self

    @property
    def factors(self) -> dict[str, ValueList | Grid]:
        """Parameters with stated values."""
        return {name: v for name, v in self.parameters.items() if isinstance(v, ValueList | Grid)}

    @property
    def distributions(self) -> dict[str, Distribution]:
        """Parameters with a distribution."""
        return {name: v for name, v in self.parameters.items() if not isinstance(v, ValueList | Grid)}

    @property
    def drives(self) -> Literal["common", "population", "independent"]:
        """Which runs have the same drive, as given or by the rule."""
        if self.surfaces is not None:
            return self.surfaces
        designed = self.sampling is None or isinstance(self.sampling, SobolIndices | Morris)
        return "common" if designed else "population"

    @property
    def paired(self) -> bool:
        """Whether all stated values are met by the same drives, so that differences are theirs alone."""
        return self.drives != "independent" and "run.seed" not in self.parameters
