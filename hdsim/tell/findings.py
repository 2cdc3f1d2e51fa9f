"""What there is to tell, as plain data: verdict, evidence, and the compared series that the figures show.

All else in `hdsim.tell` reads these; only `gather` walks through a live diagnosis.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.diagnosis.coordinates import coordinates
from hdsim.diagnosis.evidence import Evidence, LawEvidence, PlaceEvidence, StageEvidence
from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.verdict import Remainder, Verdict
from hdsim.diagnosis.workflow import LEAST_REST
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
    """One predicted channel of one record, and what the models leave of it; arrays of shape (n,), SI units.

    Attributes:
        record: number of the record.
        channel: name of the channel.
        time: s.
        measured: the channel.
        motor_angle: the motion that was prescribed.
        ratio: motor angle over output angle, signed.
        train: samples that fits have seen.
        hold: samples that only the proof has seen.
        noise: standard deviation of the channel's noise.
        left: measured less predicted, by model: ``before``, ``refit``, ``after``.
        over: coordinates by name; of the first series of each channel only.
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
    """Held-out gap of a channel with its 95 % interval, SI units, with only some of the named effects."""

    effects: tuple[str, ...]
    gap: Mapping[str, tuple[float, tuple[float, float]]]


@dataclass(frozen=True)
class Findings:
    """All that is told of a diagnosis.

    Attributes:
        verdict: what was found.
        evidence: what it rests on.
        runs: the measured records.
        series: the compared channels.
        steps: held-out gaps on the way, where several effects are named.
        lines: peaks of each channel's order spectrum, of what the re-fitted model leaves.
        settings: of each named effect, as in a scenario.
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
        """The pass of the search that began with the most structure."""
        return max(self.evidence.stages, key=lambda stage: stage.structured, default=None)

    @property
    def places(self) -> list[PlaceEvidence]:
        """Where the re-fitted model's residual lives, strongest first."""
        return self.evidence.stages[0].places if self.evidence.stages else []

    @property
    def patterned(self) -> bool:
        """Whether what is left is, beyond chance, a function of some coordinate."""
        evidence = self.evidence
        return evidence.left_chance <= RULES.chance and evidence.left >= RULES.structured

    @property
    def once(self) -> Remainder | None:
        """What is left without a place, where it is no pattern and no curve says it better."""
        return None if self.patterned or self.verdict.curve is not None else self.verdict.remainder

    @property
    def nearest(self) -> tuple[list[str], float]:
        """Effects that explain most of the structure, and how much of it; without a fitted one none and 0."""
        laws = self.evidence.laws
        if laws:
            return [law.name for law in laws], self.evidence.explained
        fitted = [one for stage in self.evidence.stages for one in stage.candidates]
        best = max(fitted, key=lambda one: one.explained, default=None)
        return ([best.name], min(best.explained, 1.0)) if best is not None else ([], 0.0)

    @property
    def pattern_chance(self) -> float:
        """Least probability that what was seen, or what the search has found, is there by chance."""
        chances = [stage.structured_chance for stage in self.evidence.stages]
        return min([*chances, *(law.chance for law in self.evidence.laws)], default=1.0)

    @property
    def not_believed(self) -> list[LawEvidence]:
        """Effects that the search has added and that have no name beside the named ones."""
        named = Counter(effect.name for effect in self.verdict.effects)
        found = []
        for law in self.evidence.laws if named else ():
            if named[law.name]:
                named[law.name] -= 1
            else:
                found.append(law)
        return found

    @property
    def unexplained(self) -> float:
        """Part of all structure that the named effects leave; 0 where none is named.

        The evidence counts all that the search has added: what only the others explain is left, too.
        """
        if not (self.verdict.effects and self.evidence.laws):
            return 0.0
        return min(1.0 - self.evidence.explained + sum(law.gain for law in self.not_believed), 1.0)

    @property
    def other_shape(self) -> tuple[float, PlaceEvidence] | None:
        """That part and where it lives, where it is no chance; None else."""
        places = self.evidence.stages[-1].places if self.evidence.stages else []
        left = 1.0 - self.evidence.explained
        real = self.evidence.left_chance <= RULES.chance and left >= LEAST_REST and self.unexplained > 0.0
        return (left, places[0]) if real and places else None

    @property
    def left_most(self) -> tuple[str, float]:
        """The channel that is left with most, and how much in units of its noise; 0 where unknown.

        Where the search has added more than is named it is the gap of the named effects alone.
        """
        rest = self.evidence.rest
        if self.not_believed and self.verdict.gap:
            each = {
                channel: gap.after / gap.noise for channel, gap in self.verdict.gap.items() if gap.noise > 0
            }
            return max(
                ((c, v) for c, v in each.items() if math.isfinite(v)), key=itemgetter(1), default=("", 0.0)
            )
        return (rest.channel, rest.times_noise) if rest and math.isfinite(rest.times_noise) else ("", 0.0)


def gather(diagnosis: Diagnosis) -> Findings:
    """What there is to tell of a diagnosis."""
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
    """Gaps of the models with the first of several named effects; none that the verdict does not name."""
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
