"""Traces have a size that suits the residual, and each start of an effect's shapes is simulated once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdsim.diagnosis import designs


@dataclass(frozen=True)
class Way:
    """A way of fitting whose trace is as large as its unit, times what its start makes of it."""

    label: str
    unit: float = 1.0
    cumulative: bool = False
    play: bool = False

    def rescaled(self, factor: float) -> Way:
        return replace(self, unit=factor * self.unit)


@dataclass(frozen=True)
class Tried:
    effect: str
    fitting: Way
    reaches: float = 1.0
    most: float = np.inf  # unit beyond which it cannot be predicted

    def to_plausible(self, _drive: object) -> float:
        return 1e9


@pytest.fixture
def simulated(monkeypatch):
    """What has been simulated, in turn."""
    done: list[Tried] = []

    def design(_bench, _state, _predictions, tried):
        done.extend(tried)
        return [
            None if one.fitting.unit > one.most else np.full((10, 1), one.fitting.unit * one.reaches)
            for one in tried
        ]

    monkeypatch.setattr(designs, "designs", design)
    return done


def traces(tried: list[Tried], wanted: float) -> list[tuple[Tried, np.ndarray]]:
    return designs.traces(None, SimpleNamespace(drive=None), [], tried, wanted)


def test_a_unit_is_found_at_the_first_start_and_serves_the_others(simulated):
    starts = [Tried("tooth", Way("a"), reaches) for reaches in (1.0, 0.7, 1.6, 1.1)]
    found = traces(starts, wanted=1e-3)
    assert len(simulated) == 1 + 3 + 1  # the first twice, the others once
    for added, columns in found:
        assert added.fitting.unit == pytest.approx(1e-3)
        assert columns[0, 0] == pytest.approx(1e-3 * added.reaches)


def test_a_start_that_needs_another_unit_gets_it(simulated):
    starts = [Tried("tooth", Way("a")), Tried("tooth", Way("a"), 100.0), Tried("tooth", Way("a"), 0.0)]
    sizes = [float(columns[0, 0]) for _, columns in traces(starts, wanted=1e-3)]
    assert sizes == pytest.approx([1e-3, 1e-3, 0.0])
    assert len(simulated) == 1 + 2 + 2


def test_a_start_that_cannot_be_predicted_in_the_others_unit_keeps_its_own(simulated):
    starts = [Tried("tooth", Way("a")), Tried("tooth", Way("a"), 3e3, most=10.0)]
    found = traces(starts, wanted=1e3)
    assert [added.fitting.unit for added, _ in found] == pytest.approx([1e3, 1.0])
    assert [float(columns[0, 0]) for _, columns in found] == pytest.approx([1e3, 3e3])


def test_a_start_that_cannot_be_predicted_in_its_own_unit_is_not_asked_twice(simulated):
    starts = [Tried("tooth", Way("a")), Tried("tooth", Way("a"), most=0.1)]
    assert [columns is None for _, columns in traces(starts, wanted=1.0)] == [False, True]
    assert len(simulated) == 2


def test_ways_of_fitting_have_units_of_their_own(simulated):
    tried = [
        Tried("tooth", Way("a")),
        Tried("tooth", Way("b", unit=0.01)),
        Tried("loop", Way("a", unit=1e-3)),
    ]
    assert [added.fitting.unit for added, _ in traces(tried, wanted=1e-2)] == pytest.approx(
        [1e-2, 1e-2, 1e-2]
    )
    # What is within the factor stays as it was.
    simulated.clear()
    traces([Tried("tooth", Way("a", unit=3e-2)), Tried("tooth", Way("a", unit=4e-3))], wanted=1e-2)
    assert len(simulated) == 2


def test_what_adds_up_or_has_a_play_keeps_its_unit(simulated):
    tried = [Tried("steps", Way("a", cumulative=True)), Tried("gap", Way("a", play=True))]
    assert [added.fitting.unit for added, _ in traces(tried, wanted=1e-6)] == [1.0, 1.0]
    assert len(simulated) == 2
