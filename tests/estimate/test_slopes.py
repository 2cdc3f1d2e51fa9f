"""Sensitivities of a model to its numbers: slopes, at an end too; what is not known stays with a fit."""

import math
from dataclasses import replace

import numpy as np
import pytest
from rig import model, record

from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import fit
from hdsim.estimate.numbers import base_freedoms
from hdsim.estimate.predict import predictors
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import Added, state_of
from hdsim.estimate.vector import Vector, sensitivities


@pytest.fixture
def rig(tmp_path):
    """A bench whose drive rings at a few hertz, weighed by its noise, and the model's state."""
    scenario = model(tmp_path)
    bench = Bench(predictors([record(0, 3.0)], scenario.drive.ratio))
    bench.weigh([np.zeros(len(series.measured)) for series in bench.series])
    return bench, state_of(scenario)


def test_what_is_far_above_the_noise_has_its_slope_not_a_secant(rig):
    # A tenth more inertia shifts the ringing by far more than the model is linear in.
    bench, state = rig
    vector = Vector(state, tuple(base_freedoms(state, bench.channels)), 0)
    x = vector.start()
    columns = sensitivities(bench, vector, x)
    for k, free in enumerate(vector.frees):
        step = 1e-3 * (np.arange(len(x)) == k)
        back, ahead = (bench.predict(vector.state(x + s)) for s in (-step, step))
        slope = bench.trace(back, ahead) / 2e-3
        if np.sqrt(np.mean(slope**2)) > 1.0:  # a standard deviation of the noise for a factor e
            assert np.linalg.norm(columns[:, k] - slope) < 0.03 * np.linalg.norm(slope), free.name


def test_a_number_at_its_upper_end_is_asked_from_below(rig):
    # Beyond the end there is no model, and no change would look like no sensitivity.
    bench, state = rig
    fitting = catalogue()["damaged_tooth"].fittings[0]
    added = Added("damaged_tooth", fitting, (0.5,), (30.0, 29.5))
    vector = Vector(replace(state, added=(added,)), (), 0)
    x = vector.start()
    x[-1] = vector.bounds()[1][-1]
    assert vector.steps(x)[-1] < 0.0 < vector.steps(vector.start() - 1.0)[-1]
    assert np.linalg.norm(sensitivities(bench, vector, x)[:, -1]) > 0.0


@pytest.mark.slow
def test_what_is_not_determined_stays_with_later_fits_and_widens_their_intervals(rig):
    bench, state = rig
    found = refit(bench, state).fit
    names = {free.name for free in found.undetermined}
    assert "motor_torque_gain" in names
    later = fit(bench, found.state, found.frees, prune=False, after=found)
    assert {free.name for free in later.undetermined} == names
    alone = fit(bench, found.state, found.frees, prune=False)
    k = [free.name for free in found.frees].index("load.inertia_kg_m2")
    # Every torque scales with the sensor's sensitivity, which is known to 15 %.
    assert 0.1 < math.sqrt(later.covariance[k, k]) < 0.2
    assert math.sqrt(alone.covariance[k, k]) < 0.02


@pytest.mark.slow
def test_all_that_was_not_determined_is_asked_again_but_for_a_sensors_sensitivity(rig):
    bench, state = rig
    found = refit(bench, state).fit
    free = found.frees[-1]
    dropped = replace(found, frees=found.frees[:-1], theta=found.theta[:-1],
                      undetermined=[*found.undetermined, free])  # fmt: skip
    again = together(bench, dropped)
    assert free.name in {each.name for each in again.frees}
    assert "motor_torque_gain" in {each.name for each in again.undetermined}
