"""The model as it was given, beside one that a re-fit has bent: where the first effect is asked for again."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import bent, rigid_record, scenario

from hdsim.diagnosis import anew
from hdsim.diagnosis import search as searching
from hdsim.diagnosis.given import AT_STAKE, is_all
from hdsim.diagnosis.point import as_given
from hdsim.estimate.opening import bench_for
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.refit import refit
from hdsim.estimate.series import Counted
from hdsim.estimate.state import number_at, state_of

INERTIA = "drive.inertia.motor_kg_m2"


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    base = scenario(tmp_path_factory.mktemp("bench"), "rigid")
    bench = bench_for([rigid_record()], [], base, None)
    return bench, refit(bench, state_of(base)).fit


def test_a_model_that_has_not_gone_far_is_asked_once(fitted):
    bench, found = fitted
    assert as_given(bench, found) is None
    assert as_given(bench, bent(bench, found, {INERTIA: 1.8})) is None


@pytest.mark.parametrize("factor", [0.4, 5.0])
def test_a_bent_model_goes_back_to_what_was_given_and_is_free_there(fitted, factor):
    bench, found = fitted
    given = as_given(bench, bent(bench, found, {INERTIA: factor}))
    assert number_at(given.state, INERTIA) == pytest.approx(5.0e-5)
    assert not given.theta.any()
    assert all(free.none == pytest.approx(0.0, abs=1e-12) for free in given.frees if not free.step)
    for free in given.frees:
        assert free.paths
        assert free.value == pytest.approx(number_at(given.state, free.paths[0]))
    for own, others in zip(given.predictions, bench.predict(given.state), strict=True):
        np.testing.assert_array_equal(own, others)
    assert given.columns.shape == found.columns.shape


def test_where_the_model_as_given_cannot_be_predicted_the_bent_one_is_asked_alone(fitted, monkeypatch):
    bench, found = fitted
    gone = bent(bench, found, {INERTIA: 5.0})

    def fails(state):
        raise PredictionError("the spring's twist must grow with torque")

    monkeypatch.setattr(bench, "predict", fails)
    assert as_given(bench, gone) is None


def test_a_fit_is_all_where_it_has_reached_the_noise_and_has_not_bent_the_base(fitted):
    bench, found = fitted
    assert is_all(bench, found)
    assert not is_all(bench, bent(bench, found, {INERTIA: 1.8}))
    # The same predictions, by numbers that were given as others.
    spread = np.sqrt(AT_STAKE) * found.frees[0].prior
    for away, expected in ((0.8, True), (1.2, False)):
        start = replace(found.frees[0], given=found.theta[0] + away * spread)
        others = [(free, theta) for free, theta in zip(found.frees, found.theta, strict=True)][1:]
        frees = [start, *(replace(free, given=float(theta)) for free, theta in others)]
        assert is_all(bench, replace(found, frees=frees)) is expected


def test_what_no_longer_counts_beside_a_first_effect_is_heard_before_the_given_is_asked(fitted, monkeypatch):
    bench, found = fitted
    named = SimpleNamespace(name="motor_torque_ripple", fit=found, worth_finer=False)
    asked: list[str] = []
    sigmas: list[float] = []

    def rests(bench, before, now):
        assert before is now is found
        sigmas.extend(series.sigma for series in bench.series)
        return True

    monkeypatch.setattr(searching, "_one_more", lambda *_: named)
    monkeypatch.setattr(searching, "_near_its_end", lambda *_: found)
    monkeypatch.setattr(searching, "_finished", lambda *_: found)
    monkeypatch.setattr(searching, "over_the_given", lambda *_: asked.append("given"))
    monkeypatch.setattr(searching, "is_all", lambda *_: False)
    monkeypatch.setattr(searching, "nothing_but_flanks", lambda *_: False)
    monkeypatch.setattr(anew, "let_swing", lambda _, now: now)
    monkeypatch.setattr(anew, "hear_swing", lambda *_: False)
    monkeypatch.setattr(anew, "hear_rest", rests)
    monkeypatch.setattr(anew, "_near", lambda *_: False)
    counted = Counted(bench.series)
    for series in bench.series:
        series.sigma *= 3.0
    result = searching.search(bench, found, lambda *_: lambda _: None)
    assert result.anew
    assert result.fit is found
    assert not asked
    counted.weigh_as_before()
    bench.weigh(bench.residuals(found.predictions))
    assert sigmas == [series.sigma for series in bench.series]  # of what the effect has left
    counted.weigh_as_before()
