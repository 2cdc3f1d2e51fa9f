"""Predictions are as exact as the sensors tell: the integrator's error is a two-thousandth of their noise."""

import numpy as np
import pytest
from moves import to_and_fro
from noisy import noisy
from test_beginning import SCENARIO as STICKS

import hdsim
from hdsim.estimate.bench import Bench
from hdsim.estimate.opening import bench_for
from hdsim.estimate.predict import RTOL
from hdsim.estimate.state import state_of
from hdsim.estimate.tolerance import PART, TRIED

SCENARIO = STICKS.with_(
    {"run.duration_s": 4.0, "command.motor.trajectory": to_and_fro((20, -20), 60, 300, 5000)}
)
NOISE = {"motor_angle": 1e-5, "motor_torque": 1.8e-3, "output_angle": 3e-6}


def opened(factor: float = 1.0) -> Bench:
    noise = {channel: factor * size for channel, size in NOISE.items()}
    return bench_for([noisy(hdsim.simulate(SCENARIO), noise, seed=1)], [], SCENARIO, None)


def error_of_noise(bench: Bench) -> float:
    """Largest error of a channel's prediction beside one that is far more exact, in units of its noise."""
    state, (predictor,) = state_of(SCENARIO), bench.predictors
    here, kept = bench.predict(state), predictor.rtol
    predictor.rtol = 1e-10
    exact = bench.predict(state)
    predictor.rtol = kept
    return max(
        float(np.sqrt(np.mean((one - other) ** 2))) / s.noise
        for s, one, other in zip(bench.series, here, exact, strict=True)
    )


@pytest.mark.parametrize("factor", [0.1, 1.0, 10.0])
def test_the_integrators_error_is_a_small_part_of_the_noise(factor):
    bench = opened(factor)
    (predictor,) = bench.predictors
    assert predictor.rtol in {*TRIED, RTOL}
    if predictor.rtol > RTOL:
        # Beside a prediction that has an error of its own.
        assert error_of_noise(bench) < 1.1 * PART


def test_a_finer_sensor_asks_for_a_closer_prediction():
    assert opened(0.01).predictors[0].rtol < opened(1.0).predictors[0].rtol


def test_a_model_that_cannot_be_predicted_is_asked_closely(monkeypatch):
    from hdsim.estimate import tolerance
    from hdsim.estimate.predict import PredictionError

    bench = opened()

    def never(*_: object, **__: object) -> None:
        raise PredictionError("it cannot be")

    monkeypatch.setattr(bench, "predict", never)
    tolerance.as_exact_as_told(bench, state_of(SCENARIO))
    assert bench.predictors[0].rtol == RTOL


def test_a_held_out_record_has_its_own():
    coarse = noisy(hdsim.simulate(SCENARIO), {c: 100.0 * s for c, s in NOISE.items()}, seed=1)
    fine = noisy(hdsim.simulate(SCENARIO), {c: 0.01 * s for c, s in NOISE.items()}, seed=2)
    one, other = bench_for([coarse], [fine], SCENARIO, None).predictors
    assert one.rtol > other.rtol
