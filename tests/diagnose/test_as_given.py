"""The model as it was given, beside one that a re-fit has bent: where the first effect is asked for again."""

from __future__ import annotations

import numpy as np
import pytest
from diagnose_bench import bent, rigid_record, scenario

from hdsim.diagnosis.point import as_given
from hdsim.estimate.opening import bench_for
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.refit import refit
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
