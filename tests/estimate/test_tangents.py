"""Tangents, integrated beside a model, against differences of whole runs: over the whole catalogue."""

from dataclasses import replace

import numpy as np
import pytest
from rig import model, record

from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.numbers import base_freedoms
from hdsim.estimate.orders import Line
from hdsim.estimate.predict import Predictor, predictors
from hdsim.estimate.state import Added, State, state_of
from hdsim.estimate.vector import Vector, sensitivities

#: Where orders begin that are read from data.
LINES = [Line(channel, 2.0, 1e-3, 0.1) for channel in ("motor_torque", "output_angle")]
#: Effects of a drive without teeth that these channels show: a spring that warms up needs a temperature.
FITTED = [
    name
    for name, kind in catalogue().items()
    if any(way.of_mesh(toothed=False) for way in getattr(kind, "fittings", ()))
    and name != "thermal_stiffness"
]
#: Part of a slope that a tangent may be off by: a sharp corner costs a step of 1e-9 up to that, and what two
#: runs at 1e-8 differ by over theirs, in standard deviations of the noise times the root of the samples.
OFF, OF_RUNS = 0.06, 0.2


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> tuple[Bench, State]:
    """A bench whose drive rings at a few hertz, weighed by its noise, and the model's state."""
    scenario = model(tmp_path_factory.mktemp("rig"))
    bench = Bench(predictors([record(0, 3.0)], scenario.drive.ratio))
    bench.weigh([np.zeros(len(series.measured)) for series in bench.series])
    for predictor in bench.predictors:
        predictor.rtol = 1e-8
    return bench, state_of(scenario)


def slope(bench: Bench, vector: Vector, x: np.ndarray, k: int) -> np.ndarray:
    """By two whole runs."""
    step = 1e-4 * max(1.0, abs(x[k]))
    both = (bench.predict(vector.state(x + s * step * (np.arange(len(x)) == k))) for s in (-1.0, 1.0))
    return bench.trace(*both) / (2.0 * step)


def same_as_whole_runs(bench: Bench, vector: Vector, monkeypatch: pytest.MonkeyPatch) -> None:
    x = vector.start()
    slopes = [slope(bench, vector, x, k) for k in range(len(x))]
    predictions = bench.predict(vector.state(x))
    with monkeypatch.context() as no_more:
        no_more.setattr(Predictor, "predict", lambda *_, **__: pytest.fail("a whole run"))
        columns = sensitivities(bench, vector, x, predictions, tangents=True)
    for column, expected in zip(columns.T, slopes, strict=True):
        assert np.linalg.norm(column - expected) < OFF * np.linalg.norm(expected) + OF_RUNS


def test_of_the_numbers_of_a_base(rig, monkeypatch):
    bench, state = rig
    frees = [free for free in base_freedoms(state, bench.channels) if not free.reading]
    assert len(frees) > 5
    same_as_whole_runs(bench, Vector(state, tuple(frees), 0), monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("name", FITTED)
def test_of_every_number_of_an_effect(rig, name, monkeypatch):
    bench, state = rig
    tried = 0
    for fitting in catalogue()[name].fittings:
        if not fitting.of_mesh(toothed=False) or not fitting.of_channels(bench.measured, bench.channels):
            continue
        begins = starts(name, fitting, LINES, bench.ranges(state))
        for added in begins[len(begins) // 2 :][:1]:
            ones = replace(added, coefficients=tuple(1.0 for _ in added.coefficients))
            same_as_whole_runs(bench, Vector(replace(state, added=(ones,)), (), 0), monkeypatch)
            tried += 1
    assert tried


def test_a_model_of_other_parts_has_none(rig):
    bench, state = rig
    play = Added("output_backlash", catalogue()["output_backlash"].fittings[0], (1.0,), ())
    same, none = bench.beside(state, [state, replace(state, added=(play,))])
    assert none is None
    for own, alike, predicted in zip(*same, bench.predict(state), strict=True):
        np.testing.assert_array_equal(own, predicted)
        np.testing.assert_array_equal(alike, predicted)
