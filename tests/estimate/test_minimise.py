"""The least-squares core beside SciPy's own on the long residual."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from hdsim.estimate.minimise import _turned, minimised

RNG = np.random.default_rng(4)
TIME = np.linspace(0.0, 3.0, 2000)
TRUE = np.array([1.3, 0.7, 0.4])
SEEN = TRUE[0] * np.exp(-TRUE[1] * TIME) + TRUE[2] + 0.05 * RNG.standard_normal(len(TIME))


class Decay:
    """An exponential decay: amplitude, rate, offset."""

    names = ("amplitude", "rate", "offset")
    start = np.array([2.0, 1.5, 0.0])
    priors = np.array([0.5, 0.8, 0.3])
    blocks = np.arange(2000) // 50
    bounds = np.array([0.0, 0.0, -1.0]), np.array([5.0, 5.0, 1.0])

    def residual(self, x):
        return SEEN - (x[0] * np.exp(-x[1] * TIME) + x[2])

    def jacobian(self, x):
        fall = np.exp(-x[1] * TIME)
        return -np.column_stack([fall, -x[0] * TIME * fall, np.ones_like(TIME)])


@pytest.mark.parametrize("most", [5.0, 0.6])
def test_the_optimum_is_that_of_the_long_residual_and_the_priors(most):
    problem, power = Decay(), 0.05**2
    problem.bounds = problem.bounds[0], np.array([5.0, most, 1.0])
    start = np.minimum(problem.start, 0.9 * problem.bounds[1])
    found = minimised(problem, start, problem.start, power, evaluations=60, rounds=6, tight=1e-12)

    def whole(x):
        return np.concatenate([problem.residual(x) / np.sqrt(power), (x - problem.start) / problem.priors])

    plain = least_squares(whole, start, bounds=problem.bounds, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    np.testing.assert_allclose(found.x, plain.x, rtol=2e-5)
    np.testing.assert_allclose(found.rest, problem.residual(found.x))


class Ragged(Decay):
    """The same, where each step beside the start adds what no slope tells of."""

    def residual(self, x):
        return super().residual(x) + 10.0 * abs(np.sin(1e5 * float(np.sum(x - self.start))))


def test_only_where_no_step_keeps_what_the_slopes_promise_is_any_of_it_left():
    power = 0.05**2
    smooth, ragged = (minimised(each, each.start, each.start, power) for each in (Decay(), Ragged()))
    assert smooth.promised < 0.25
    assert np.max(np.abs(ragged.x - Ragged.start)) < 1e-3
    # All that the data have against the start, but for what the priors keep of it.
    fall = (np.sum(ragged.rest**2) - np.sum(smooth.rest**2)) / power
    assert ragged.promised == pytest.approx(fall, rel=0.3)


@pytest.mark.parametrize("values", [RNG.standard_normal(6), np.eye(6)[-1]])
def test_turning_keeps_every_product(values):
    columns = RNG.standard_normal((6, 4))
    turned = _turned(columns, values)
    np.testing.assert_allclose(turned.T @ turned, columns.T @ columns)
    np.testing.assert_allclose(turned[-1] * np.linalg.norm(values), columns.T @ values)
