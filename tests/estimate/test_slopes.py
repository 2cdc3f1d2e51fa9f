"""Sensitivities of a model to its numbers: slopes, at an end too; what is not known stays with a fit."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rig import model, record

from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import _made_up, fit
from hdsim.estimate.numbers import base_freedoms
from hdsim.estimate.predict import predictors
from hdsim.estimate.refit import refit, together
from hdsim.estimate.slopes import Slopes
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


class Cornered:
    """Three numbers of which the third shows nothing until a spring's next section is reached, and then much.

    What it shows until then is rounding, along what the first does.
    """

    names = ("stiffness", "inertia", "corner")
    start, priors, bounds = np.zeros(3), np.ones(3), (np.full(3, -np.inf), np.full(3, np.inf))
    blocks = np.arange(400) // 20
    slopes = np.random.default_rng(3).standard_normal((400, 3)) * [100.0, 100.0, 0.0]
    slopes[:, 2] = 1e-8 * slopes[:, 0]

    def predicted(self, x):
        reached = -x[2] > 1e-3
        return self.slopes @ x + reached * np.sin(np.arange(400.0))

    def residual(self, x):
        return -self.predicted(x)

    def steps(self, x):
        return np.full(3, 0.03)

    def changes(self, pairs):
        return [self.predicted(ahead) - self.predicted(back) for back, ahead in pairs]

    def sensitivities(self, x, first=0, like=None, *, tangents=False):
        return self.slopes[:, first:]


def test_a_number_that_turns_out_to_matter_does_not_bend_what_others_do():
    """Their columns had been made 1e8 times as long, and every interval as narrow."""
    problem = Cornered()
    columns = Slopes(problem).proved(np.zeros(3))
    assert np.linalg.norm(columns[:, :2] - problem.slopes[:, :2]) < 0.01 * np.linalg.norm(problem.slopes)
    assert np.linalg.norm(columns[:, 2]) > 100.0  # the change over its step


@pytest.mark.parametrize(("bumpy", "where"), [(1.0, 0.5), (0.0, 0.0)])
def test_a_fit_begins_where_the_others_make_up_for_what_is_gone(bumpy, where):
    """The first number does what the model has lost, at half the size; in between nothing leads there."""
    direction = np.ones(100)
    columns = direction[:, None]
    problem = SimpleNamespace(
        priors=np.ones(1),
        bounds=(np.array([-2.0]), np.array([2.0])),
        vector=SimpleNamespace(frees=["mass"], rates=lambda _: np.ones(1)),
        residual=lambda x: (0.5 - x[0]) * direction if bumpy else x[0] * direction,
    )
    assert _made_up(problem, np.zeros(1), columns, -0.5 * direction)[0] == pytest.approx(where, abs=1e-6)


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
