"""A log that was cut out of a motion: the vibration that it begins with shows once an effect is named."""

from dataclasses import replace

import numpy as np
import pytest
from moves import positioned
from noisy import noisy

import hdsim
from hdsim.diagnosis.starts import starts
from hdsim.diagnosis.swing import hear_swing, let_swing
from hdsim.diagnosis.workflow import diagnose
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present, fit, sharpened
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.refit import as_far_as_promised, refit
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

NAME = "kinematic_error"
NOISE = {"motor_angle": 3.5e-5, "output_angle": 3e-6, "motor_torque": 2e-3}
#: At its highest speed, where order 2 meets the load's resonance; there the log begins.
FASTEST_S, AT_REST_S = 0.5, 0.0
BASE = {
    # So damped that most of the vibration is over when no more can be left out.
    "drive": {
        "preset": "seed-2021", "mesh": {"model": "lumped"}, "torsion": {"damping_nm_s_per_rad": 15.0},
    },
    "command": positioned(
        {"type": "sine", "amplitude_deg": 15.0, "frequency_hz": 0.5, "phase_deg": -90, "offset_deg": 15.0},
        position_gain_per_s=40,
    ),
    "load": {"inertia_kg_m2": 0.5},
    "run": {"duration_s": 8.0, "sample_rate_hz": 500.0},
}  # fmt: skip
ERROR = {"components": [{"order": 2, "amplitude_arcmin": 0.6, "phase_deg": 30.0}]}


def record(begins_s: float) -> Record:
    run = hdsim.simulate(Scenario.model_validate(BASE | {"effects": {NAME: ERROR}}))
    return noisy(run, NOISE, seed=3, begins_s=begins_s)


def with_the_error(begins_s: float) -> tuple[Bench, Fit]:
    """The log, and the model with the kinematic error, its numbers fitted to all of it."""
    base = Scenario.model_validate(BASE)
    bench = bench_for([record(begins_s)], [], base, None)
    found = refit(bench, state_of(base)).fit
    added, *_ = starts(NAME, catalogue()[NAME].fittings[0], (), bench.ranges(found.state))
    state = replace(found.state, added=(replace(added, coefficients=(5.0, 3.0, 0.0, 0.0, 0.0, 0.0)),))
    one = fit(bench, state, at_present(found), prune=False, after=found, evaluations=30, rough=True)
    return bench, one


def carried_on(begins_s: float) -> tuple[Bench, Fit]:
    """The same near its end, weighed by what it leaves, as a search has it."""
    bench, found = with_the_error(begins_s)
    found = as_far_as_promised(bench, sharpened(bench, found))
    bench.weigh(bench.residuals(found.predictions))
    return bench, found


def times_noise(bench: Bench, predictions: list[np.ndarray]) -> float:
    """What is left of the output's angle, over its noise."""
    (rest,) = (
        rest[series.train] / series.noise
        for series, rest in zip(bench.series, bench.residuals(predictions), strict=True)
        if series.channel == "output_angle"
    )
    return float(np.sqrt(np.mean(rest**2)))


@pytest.mark.slow
def test_a_vibration_behind_an_effect_no_longer_counts():
    bench, found = with_the_error(FASTEST_S)
    before = bench.begins_s.get(0, 0.0)
    assert hear_swing(bench, found)
    assert before < 0.1 < bench.begins_s[0]
    first = min(bench.time_of(s)[s.train][0] for s in bench.series)
    assert first >= bench.begins_s[0]


@pytest.mark.slow
def test_a_load_that_swings_behind_an_effect_does_so_in_the_model():
    bench, found = carried_on(FASTEST_S)
    counted = [s.train.copy() for s in bench.series]
    before = times_noise(bench, found.predictions)
    free = let_swing(bench, found)
    assert before > 2.0
    assert times_noise(bench, free.predictions) < 1.1
    assert list(bench.swings) == [0]
    assert all(np.array_equal(s.train, rows) for s, rows in zip(bench.series, counted, strict=True))
    # What is taken out beside has hardly anything left to do.
    bench.swings = {}
    assert times_noise(bench, bench.predict(free.state)) < 1.1


@pytest.mark.slow
def test_a_record_that_begins_at_rest_has_no_load_that_swings():
    bench, found = carried_on(AT_REST_S)
    assert let_swing(bench, found) is found
    assert bench.swings == {}


@pytest.mark.slow
def test_a_record_that_begins_at_rest_stays_whole():
    bench, found = with_the_error(AT_REST_S)
    kept = [(series.train.copy(), series.hold.copy()) for series in bench.series]
    assert not hear_swing(bench, found)
    for series, (train, hold) in zip(bench.series, kept, strict=True):
        assert np.array_equal(series.train, train)
        assert np.array_equal(series.hold, hold)


def test_a_model_that_leaves_no_more_than_the_noise_does_not_begin_anew():
    """Nothing was left out, and half of less than nothing is more: it would be asked for ever."""
    base = Scenario.model_validate(BASE)
    bench = bench_for([record(AT_REST_S)], [], base, None)
    found = refit(bench, state_of(base)).fit
    for series, predicted in zip(bench.series, found.predictions, strict=True):
        series.measured = predicted.copy()
    assert not hear_swing(bench, found)


@pytest.mark.study
def test_the_effect_has_its_true_numbers():
    found = diagnose([record(FASTEST_S)], Scenario.model_validate(BASE)).verdict
    assert [one.name for one in found.effects] == [NAME]
    numbers = found.effects[0].parameters
    assert numbers["components.0.amplitude_arcmin"].value == pytest.approx(0.6, rel=0.02)
    assert numbers["components.0.phase_deg"].value == pytest.approx(30.0, abs=1.0)
    assert found.gap["output_angle"].after < 1.3 * found.gap["output_angle"].noise
    assert any(problem.kind == "beginning" for problem in found.data_problems)
