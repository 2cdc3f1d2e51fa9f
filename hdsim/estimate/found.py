"""What a fit and a check find, as data: what result files hold."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict


class Part(BaseModel):
    """A part of a result file."""

    model_config = ConfigDict(use_attribute_docstrings=True, extra="forbid")


class ParameterEstimate(Part):
    """A parameter estimate."""

    value: float
    """Its value, in the unit of its field's name."""
    interval: tuple[float, float] | None = None
    """95 % confidence interval; null when it is not identifiable from the data."""
    start: float | None = None
    """Its value in the base model, where it has one."""
    tied_to: list[str] = []
    """Parameters that it is confounded with in these data."""


class Gap(Part):
    """Root-mean-square residual (measurement minus model) of one channel, on held-out data."""

    before: float
    """Of the model as given, offsets removed."""
    refit: float
    """Of the model with re-estimated parameters."""
    after: float
    """With the identified effects."""
    with_curve: float | None = None
    """With the curve of what they leave, too, where held-out data bear it out."""
    noise: float
    """Standard deviation of the channel's noise, from differences of neighbouring readings: no lower bound.
    Slowly varying errors exceed it; a model that predicts a part of them may come below."""
    regression: float | None = None
    """Of a linear regression of the same training samples (``hdsim/estimate/baseline.py``)."""
    black_box: float | None = None
    """Of gradient boosting after that regression, where it was asked for."""
    repeats: float | None = None
    """Share of the power of what ``after`` leaves, held out or not, that repeats from one turn of the wave
    generator to the next (``hdsim/estimate/repeat.py``); None where too few turns are there."""
    unit: str
    """Unit of all residuals."""
    data: Literal["holdout"] = "holdout"
    """What they were computed on."""
    variation: float
    """Standard deviation of the measured channel (of the transmission error, for the output's angle)."""
    intervals: dict[str, tuple[float, float]] = {}
    """95 % intervals by the names of the above, from resampled blocks of time."""


class ShortCut(Part):
    """How predictions with teeth were made cheaper, see ``hdsim/estimate/short_cut.py``."""

    taken: bool
    """Whether the fits took it; not where it erred too far at the base model."""
    error: dict[str, float]
    """How far its predictions are from those of the whole model: standard deviation over the noise, by
    channel; of the final model, or of the base where it was not taken."""


class DataProblem(Part):
    """Something wrong with the data."""

    record: str
    channel: str
    kind: str
    severity: str
    message: str
    count: int = 0
