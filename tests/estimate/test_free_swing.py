"""A record that begins with a jump into its motion: how its load swings then is found beside the model."""

from dataclasses import replace

import numpy as np
import pytest
from moves import to_and_fro
from noisy import noisy
from test_beginning import SCENARIO as STICKS

import hdsim
from hdsim.estimate.beginning import beginnings
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import fit
from hdsim.estimate.free_swing import swinging
from hdsim.estimate.numbers import base_freedoms, scaled
from hdsim.estimate.opening import bench_for
from hdsim.estimate.predict import RTOL
from hdsim.estimate.prove import gaps
from hdsim.estimate.state import State, state_of

#: Without what a motion does not tell: the friction that holds the motor where it turns round.
SCENARIO = STICKS.with_({"drive.friction.coulomb_nm": 0.0, "run.duration_s": 6.0})
#: The motor's is small against the output's: what it does to a prescribed motion would swing the load too.
NOISE = {"motor_angle": 1e-5, "motor_torque": 1.8e-3, "output_angle": 3e-6}
STIFFNESS = "drive.torsion.stiffness_k1_nm_per_rad"


@pytest.fixture
def opened() -> tuple[Bench, State, list[np.ndarray]]:
    """A run from rest whose motor has its full speed at once, the true model, and what that predicts."""
    bench = bench_for([noisy(hdsim.simulate(SCENARIO), NOISE, seed=1)], [], SCENARIO, None)
    state = state_of(SCENARIO)
    predictions = bench.predict(state)
    bench.weigh(bench.residuals(predictions))
    return bench, state, predictions


def times_noise(bench: Bench, predictions: list[np.ndarray], channel: str) -> float:
    (rest,) = (
        r[s.train] / s.noise
        for s, r in zip(bench.series, bench.residuals(predictions), strict=True)
        if s.channel == channel
    )
    return float(np.sqrt(np.mean(rest**2)))


def test_a_load_at_rest_that_a_motor_jumps_ahead_of_is_found(opened):
    bench, state, predictions = opened
    before = times_noise(bench, predictions, "output_angle")
    found, predictions = swinging(bench, state, predictions)
    assert before > 10.0
    assert times_noise(bench, predictions, "output_angle") < 1.1
    # Beside the motion that a prediction begins in, the load goes back as fast as that goes on.
    ideal = bench.predictors[0].motor_velocity[0] / bench.predictors[0].ratio
    angle, speed = found.swings[0]
    assert speed == pytest.approx(-ideal, rel=0.01)
    assert abs(angle) < 0.1 * abs(ideal) / (2.0 * np.pi)
    # A prediction of that model alone has it, without what is taken out beside.
    bench.swings = {}
    assert times_noise(bench, predictions, "output_angle") < 1.1


def test_a_load_swings_with_the_numbers_that_move(opened):
    """From a spring that is too stiff: a swing that suits the wrong one is not left as it was."""
    bench, state, predictions = opened
    (stiffness,) = (one for one in base_freedoms(state, bench.channels) if one.name == STIFFNESS)
    wrong = scaled(state, [stiffness], [0.03])
    found, predictions = swinging(bench, wrong, bench.predict(wrong))
    before = times_noise(bench, predictions, "output_angle")
    fitted = fit(bench, found, [stiffness.moved(0.03)], prune=False)
    assert fitted.frees[0].at(float(fitted.theta[0])) == pytest.approx(stiffness.value, rel=0.01)
    assert before > 2.0
    assert times_noise(bench, fitted.predictions, "output_angle") < 1.1
    ideal = bench.predictors[0].motor_velocity[0] / bench.predictors[0].ratio
    assert fitted.state.swings[0][1] == pytest.approx(-ideal, rel=0.05)
    # The fit's predictions are those of its state.
    for one, other in zip(fitted.predictions, bench.predict(fitted.state), strict=True):
        assert one == pytest.approx(other, rel=1e-12)


def test_what_more_of_a_swing_does_is_taken_out_as_a_zero_is(opened):
    bench, state, predictions = opened
    bench.predictors[0].rtol = RTOL  # columns are as good as the steps that they are integrated along
    found, predictions = swinging(bench, state, predictions)
    columns = bench.offset_columns()
    rest = bench.stacked(bench.residuals(predictions))
    assert columns.shape == (len(rest), 4)  # two zeros, an angle and a speed
    columns /= np.linalg.norm(columns, axis=0)
    assert np.abs(columns.T @ rest).max() < 1e-6 * np.linalg.norm(rest)
    angle, speed = found.swings[0]
    more = bench.predict(replace(found, swings={0: (angle + 1e-7, speed - 1e-5)}))
    change = bench.trace(predictions, more)
    plain = np.concatenate([
        (b - a)[s.train] / s.sigma for s, a, b in zip(bench.series, predictions, more, strict=True)
    ])  # fmt: skip
    assert np.linalg.norm(change) < 1e-2 * np.linalg.norm(plain)


def test_a_record_that_begins_at_rest_does_not_swing():
    moves = to_and_fro((20, -20), 60, 300, 5000)
    moves["moves"].insert(0, {"type": "hold", "duration_s": 0.3})
    scenario = SCENARIO.with_({"command.motor.trajectory": moves})
    bench = bench_for([noisy(hdsim.simulate(scenario), NOISE, seed=1)], [], scenario, None)
    state = state_of(scenario)
    predictions = bench.predict(state)
    bench.weigh(bench.residuals(predictions))
    found, now = swinging(bench, state, predictions)
    assert found is state
    assert now is predictions
    assert bench.swings == {}


def test_the_report_says_that_a_load_swings(opened):
    bench, state, predictions = opened
    assert beginnings(bench) == []
    swinging(bench, state, predictions)
    (said,) = beginnings(bench)
    assert said.kind == "beginning"
    assert "swing" in said.message


def test_a_held_out_record_swings_in_its_own_way(opened):
    """Twice as far to and fro: no number of the training record's swing is its own."""
    _, state, _ = opened
    further = SCENARIO.with_({"command.motor.trajectory.amplitude_deg": 44.0})
    records = [noisy(hdsim.simulate(one), NOISE, seed=seed) for seed, one in enumerate((SCENARIO, further))]
    bench = bench_for(records[:1], records[1:], SCENARIO, None)
    predictions = bench.predict(state)
    bench.weigh(bench.residuals(predictions))
    stages = dict.fromkeys(("before", "refit", "after"), state)
    without = gaps(bench, stages)[0]["output_angle"].after
    assert bench.begins_s.pop(1) > 0.1  # so much of it did not count, and some is still left
    bench = bench_for(records[:1], records[1:], SCENARIO, None)
    bench.weigh(bench.residuals(predictions))
    found, _ = swinging(bench, state, predictions)
    gap = gaps(bench, stages | {"after": found})[0]["output_angle"]
    assert gap.after < 1.1 * gap.noise < without
    assert bench.begins_s == {}
