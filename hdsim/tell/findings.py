"""Everything that is reported, as plain data: verdict, evidence, and the compared series of the figures.

All else in `hdsim.tell` reads these; only `gather` reads a live diagnosis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.diagnosis.coordinates import coordinates
from hdsim.diagnosis.evidence import Evidence, PlaceEvidence, StageEvidence
from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.verdict import Remainder, Verdict
from hdsim.estimate.orders import Line, order_lines
from hdsim.estimate.prove import held_out_gap

if TYPE_CHECKING:
    from hdsim.diagnosis.workflow import Diagnosis
    from hdsim.estimate.records import Array, Mask


@dataclass(frozen=True)
class Run:
    """One measured record: its name, length (s), time between readings (s), whether it is held out.

    ``readings``: successive ones whose mean was compared.
    """

    name: str
    duration_s: float
    period_s: float
    held: bool
    readings: int = 1


@dataclass(frozen=True)
class Compared:
    """One predicted channel of one record with the residuals of the models; arrays of shape (n,), SI units.

    Attributes:
        record: number of the record.
        channel: name of the channel.
        time: s.
        measured: the channel.
        motor_angle: the motion that was prescribed.
        ratio: motor angle over output angle, signed.
        train: samples used by the fits.
        hold: held-out samples, used by the validation only.
        noise: standard deviation of the channel's noise.
        left: residuals (measured less predicted), by model: ``before``, ``refit``, ``after``.
        over: regressors by name; of the first series of each channel only.
    """

    record: int
    channel: str
    time: Array
    measured: Array
    motor_angle: Array
    ratio: float
    train: Mask
    hold: Mask
    noise: float
    left: Mapping[str, Array]
    over: Mapping[str, Array] = field(default_factory=dict)

    @property
    def ideal(self) -> Array:
        """Output's angle of a drive without error, rad."""
        return np.asarray(self.motor_angle / self.ratio)

    @property
    def period_s(self) -> float:
        """Median time between samples, s."""
        return float(np.median(np.diff(self.time)))


@dataclass(frozen=True)
class Step:
    """Held-out RMS residual of a channel with its 95 % interval, SI units, with only some of the effects."""

    effects: tuple[str, ...]
    gap: Mapping[str, tuple[float, tuple[float, float]]]


@dataclass(frozen=True)
class Findings:
    """Everything that is reported of a diagnosis.

    Attributes:
        verdict: what was found.
        evidence: what it rests on.
        runs: the measured records.
        series: the compared channels.
        steps: held-out residuals in between, where several effects are identified.
        lines: peaks of the order spectrum of each channel's residual, re-fitted model.
        settings: of each identified effect, as in a scenario.
        turns: longest travel of the wave generator in a record, turns.
    """

    verdict: Verdict
    evidence: Evidence = field(default_factory=Evidence)
    runs: tuple[Run, ...] = ()
    series: tuple[Compared, ...] = ()
    steps: tuple[Step, ...] = ()
    lines: Mapping[str, list[Line]] = field(default_factory=dict)
    settings: tuple[Mapping[str, Any], ...] = ()
    turns: float = 0.0

    @property
    def channels(self) -> tuple[str, ...]:
        """The compared channels, each once."""
        return tuple(dict.fromkeys(series.channel for series in self.series))

    @property
    def search_chance(self) -> float:
        """Probability that the last search finds its best share where nothing is missing."""
        return self.evidence.stages[-1].chance if self.evidence.stages else 1.0

    @property
    def strongest(self) -> StageEvidence | None:
        """The pass of the search that began with the largest systematic residual."""
        return max(self.evidence.stages, key=lambda stage: stage.structured, default=None)

    @property
    def places(self) -> list[PlaceEvidence]:
        """What the re-fitted model's residual depends on, strongest first."""
        return self.evidence.stages[0].places if self.evidence.stages else []

    @property
    def patterned(self) -> bool:
        """Whether the residual is, beyond chance, a function of some regressor."""
        evidence = self.evidence
        return evidence.left_chance <= RULES.chance and evidence.left >= RULES.structured

    @property
    def once(self) -> Remainder | None:
        """A residual that depends on no regressor, unless it is a pattern or a curve describes it better."""
        return None if self.patterned or self.verdict.curve is not None else self.verdict.remainder

    @property
    def nearest(self) -> tuple[list[str], float]:
        """Effects that explain most of the systematic residual, and their share; none and 0 without a fit."""
        laws = self.evidence.laws
        if laws:
            return [law.name for law in laws], self.evidence.explained
        fitted = [one for stage in self.evidence.stages for one in stage.candidates]
        best = max(fitted, key=lambda one: one.explained, default=None)
        return ([best.name], min(best.explained, 1.0)) if best is not None else ([], 0.0)

    @property
    def unexplained(self) -> float:
        """Share of the systematic residual that the identified effects do not explain; 0 without one."""
        return 1.0 - self.evidence.explained if self.verdict.effects and self.evidence.laws else 0.0

    @property
    def left_most(self) -> tuple[str, str, float]:
        """Training record and channel with the largest residual over its noise, and that ratio; or 0."""
        rest = self.evidence.rest
        if rest is None or not math.isfinite(rest.times_noise):
            return "", "", 0.0
        return rest.record, rest.channel, rest.times_noise


def gather(diagnosis: Diagnosis) -> Findings:
    """What is to be reported of a diagnosis."""
    bench, verdict = diagnosis.bench, diagnosis.verdict
    left = {stage: bench.residuals(found, drift=True) for stage, found in diagnosis.predictions.items()}
    series = []
    for k, one in enumerate(bench.series if left else ()):
        predictor = bench.predictors[one.record]
        first = all(other.channel != one.channel for other in bench.series[:k])
        series.append(
            Compared(
                record=one.record,
                channel=one.channel,
                time=predictor.record.time,
                measured=one.measured,
                motor_angle=predictor.motor_angle,
                ratio=predictor.ratio,
                train=one.train,
                hold=one.hold,
                noise=one.noise,
                left={stage: residuals[k] for stage, residuals in left.items()},
                over=coordinates(bench, one, left["refit"]) if first else {},
            )
        )
    return Findings(
        verdict=verdict,
        evidence=diagnosis.evidence,
        runs=tuple(
            Run(
                p.record.name,
                p.record.duration_s,
                p.record.as_read.period_s,
                held=k >= bench.training,
                readings=p.record.readings,
            )
            for k, p in enumerate(bench.predictors)
        ),
        series=tuple(series),
        steps=_steps(diagnosis),
        lines={c: order_lines(bench, left["refit"], c) for c in bench.channels} if left else {},
        settings=tuple(added.settings() for added in diagnosis.final.state.added),
        turns=bench.turns,
    )


def _steps(diagnosis: Diagnosis) -> tuple[Step, ...]:
    """Residuals of the models with the first of several identified effects."""
    bench, names = diagnosis.bench, {effect.name for effect in diagnosis.verdict.effects}
    found = []
    for stage in diagnosis.stages:
        state = stage.named.fit.state if stage.named is not None else None
        if state is None or not len(state.added) < len(diagnosis.verdict.effects):
            continue
        effects = tuple(added.effect for added in state.added)
        if not names.issuperset(effects):
            continue
        residuals = bench.residuals(bench.predict(state, everything=True), drift=True)
        gap = {
            channel: held_out_gap(bench, channel, residuals, np.random.default_rng(17))
            for channel in diagnosis.verdict.gap
        }
        found.append(Step(effects, gap))
    return tuple(found)
