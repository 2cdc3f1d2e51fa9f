"""Positioning of a simulated axis: approaches found in the run, figures of ISO 230-2 and ISO 9283."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.studies.metrics._spans import ARCSEC, dwells
from hdsim.studies.metrics.iso import (
    PositioningErrors,
    half_range,
    iso_230_2,
    iso_9283_angle_repeatability,
    iso_9283_repeatability,
)
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

_ISO_230 = "ISO 230-2:2014"
_ISO_9283 = "ISO 9283:1998, 7.2.2"


@dataclass(frozen=True)
class Approaches:
    """Repeated approaches of one target from one side.

    Args:
        target: commanded angle, rad.
        direction: +1 or -1, sign of the move that ended there.
        deviations: attained less commanded angle, rad, in order of time.
    """

    target: float
    direction: int
    deviations: Array


def approaches(recording: Recording) -> list[Approaches]:
    """The dwells of a run sorted by target and direction of approach, in order of target."""
    found: dict[tuple[float, int], list[float]] = {}
    angle = recording["output_angle"]
    for dwell in dwells(recording):
        key = (round(dwell.target, 9), 1 if dwell.move > 0 else -1)
        found.setdefault(key, []).append(dwell.attained(angle) - dwell.target)
    return [Approaches(target, way, np.array(found[target, way])) for target, way in sorted(found)]


def positioning_errors(recording: Recording) -> tuple[Array, PositioningErrors]:
    """Targets (rad, shape (m,)) that are approached from both sides, and their figures in arcsec.

    When the approaches of a target differ in number, the last ones count, as many as all targets have.

    Raises:
        InputError: no target is approached at least twice from both sides.
    """
    by_key = {(one.target, one.direction): one.deviations for one in approaches(recording)}
    targets = [
        t for t, way in by_key if way > 0 and len(by_key.get((t, -1), ())) > 1 and len(by_key[t, 1]) > 1
    ]
    if not targets:
        raise InputError("bidirectional positioning needs targets that are approached twice from both sides")
    number = min(len(by_key[t, way]) for t in targets for way in (1, -1))
    up, down = (np.array([by_key[t, way][-number:] for t in targets]) for way in (1, -1))
    return np.array(targets), iso_230_2(ARCSEC * up, ARCSEC * down)


def _iso_230(name: str, symbol: str, description: str, value: Callable[[PositioningErrors], float]) -> None:
    @metric(name, "arcsec", f"{symbol}: {description}", _ISO_230)
    def figure(recording: Recording, scenario: Scenario) -> float:
        return value(positioning_errors(recording)[1])


_iso_230("positioning_accuracy", "A", "bidirectional accuracy of positioning", lambda e: e.accuracy)
_iso_230("positioning_accuracy_up", "A up", "accuracy, positive approach", lambda e: e.accuracy_up)
_iso_230("positioning_accuracy_down", "A down", "accuracy, negative approach", lambda e: e.accuracy_down)
_iso_230("positioning_repeatability", "R", "bidirectional repeatability", lambda e: e.repeatability)
_iso_230(
    "positioning_repeatability_up", "R up", "repeatability, positive approach", lambda e: e.repeatability_up
)
_iso_230(
    "positioning_repeatability_down",
    "R down",
    "repeatability, negative approach",
    lambda e: e.repeatability_down,
)
_iso_230("positioning_reversal", "B", "reversal error of the axis", lambda e: e.reversal)
_iso_230("positioning_mean_reversal", "mean B", "mean reversal error, signed", lambda e: e.mean_reversal)
_iso_230("positioning_mean_error", "M", "mean bidirectional positioning error", lambda e: e.mean_error)
_iso_230("positioning_systematic", "E", "bidirectional systematic positioning error", lambda e: e.systematic)
_iso_230(
    "positioning_systematic_up", "E up", "systematic error, positive approach", lambda e: e.systematic_up
)
_iso_230(
    "positioning_systematic_down",
    "E down",
    "systematic error, negative approach",
    lambda e: e.systematic_down,
)


def _repeated(recording: Recording) -> list[Array]:
    """Deviations of every target that is approached at least twice from one side, arcsec."""
    found = [ARCSEC * one.deviations for one in approaches(recording) if len(one.deviations) > 1]
    if not found:
        raise InputError("repeatability needs a target that is approached at least twice from one side")
    return found


@metric(
    "repeatability",
    "arcsec",
    "+- half the largest difference of approaches from one side",
    "Harmonic Drive AG",
)
def repeatability(recording: Recording, scenario: Scenario) -> float:
    """Half range of repeated approaches, worst target and direction, arcsec."""
    return max(half_range(one) for one in _repeated(recording))


@metric("repeatability_angle", "arcsec", "+- 3 S of the joint angle, worst target and side", _ISO_9283)
def repeatability_angle(recording: Recording, scenario: Scenario) -> float:
    """Three standard deviations of repeated approaches, worst target and direction, arcsec."""
    return max(iso_9283_angle_repeatability(one) for one in _repeated(recording))


@metric("repeatability_positioning", "arcsec", "RP = mean distance + 3 S_l, worst target and side", _ISO_9283)
def repeatability_positioning(recording: Recording, scenario: Scenario) -> float:
    """Positioning repeatability RP seen from the axis, worst target and direction, arcsec."""
    return max(iso_9283_repeatability(one).positioning for one in _repeated(recording))
