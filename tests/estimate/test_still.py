"""A coarse encoder at rest: its readings there are one reading."""

import numpy as np

import hdsim
import hdsim.scenario
from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record
from hdsim.estimate.still import once_at_rest
from tests.moves import MOVES, NOISE

STEP = 2.4e-5


def read(angle, noise=0.0):
    rng = np.random.default_rng(5)
    return STEP * np.round((angle + noise * rng.standard_normal(len(angle))) / STEP)


def test_a_rest_is_one_reading_and_a_steady_motion_all_of_its():
    angle = np.concatenate([np.linspace(0.0, 1e-3, 400), np.full(500, 1e-3), np.linspace(1e-3, 2e-3, 2000)])
    counts = once_at_rest(read(angle), angle, STEP)
    assert counts[10:390].all()
    assert counts[410:890].sum() == 1
    assert counts[960:-60].all()


def test_noise_larger_than_the_step_makes_every_reading_one_of_its_own():
    angle = np.full(2000, 1e-3)
    assert once_at_rest(read(angle, noise=2.0 * STEP), angle, STEP).mean() > 0.95


def test_without_steps_all_count():
    assert once_at_rest(np.zeros(50), np.zeros(50), 0.0).all()


def test_rests_between_moves_weigh_as_one_reading_each_in_a_comparison():
    scenario = hdsim.scenario.Scenario.model_validate(MOVES)
    run = hdsim.simulate(scenario)
    rng = np.random.default_rng(3)
    channels = {c: run[c] + s * rng.standard_normal(len(run.time)) for c, s in NOISE.items()}
    fine = Record("run", run.time, channels)
    coarse = Record("run", run.time, channels | {"output_angle": read(channels["output_angle"])})
    rest = np.abs(np.gradient(run["output_angle"], run.time)) < 1e-4

    def counted(record):
        bench = Bench(predictors([record], scenario.drive.ratio))
        series = next(s for s in bench.series if s.channel == "output_angle")
        return (series.train | series.hold)[rest[: len(series.train)]].mean()

    assert counted(fine) > 0.9
    assert counted(coarse) < 0.1
