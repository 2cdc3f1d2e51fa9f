"""Anybody's residual against closed forms and SciPy."""

import math

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.signal import lfilter

from hdsim.errors import InputError
from hdsim.estimate import solve

T = np.linspace(0.0, 4.0, 400)
TRUE = np.array([2.0, 0.8, 0.3])


def decay(t, size, rate, rest):
    return size * np.exp(-rate * t) + rest


class Decay:
    """An exponential that falls to a rest."""

    names = ("size", "rate", "rest")
    start = np.array([1.0, 2.0, 0.0])
    priors = np.full(3, math.inf)
    bounds = (np.array([0.0, 0.0, -10.0]), np.array([10.0, 20.0, 10.0]))

    def __init__(self, measured, blocks=None):
        self.measured = measured
        self.blocks = np.arange(len(T)) if blocks is None else blocks

    def residual(self, x):
        return self.measured - decay(T, *x)


class Derived(Decay):
    """The same with its derivatives."""

    def jacobian(self, x):
        falls = np.exp(-x[1] * T)
        return -np.column_stack([falls, -x[0] * T * falls, np.ones_like(T)])


@pytest.mark.parametrize("kind", [Decay, Derived])
def test_white_noise_gives_scipys_numbers_and_covariance(kind):
    ratios, correlations, scipys = [], [], []
    for seed in range(10):
        measured = decay(T, *TRUE) + 0.05 * np.random.default_rng(seed).standard_normal(len(T))
        found = solve(kind(measured))
        x, covariance = curve_fit(decay, T, measured, p0=TRUE)
        spread = np.sqrt(np.diag(covariance))
        assert np.all(np.abs(found.x - x) < 0.03 * spread)
        assert found.determined.all()
        ratios.append(np.sqrt(np.diag(found.covariance)) / spread)
        correlations.append(found.correlation)
        scipys.append(covariance / np.outer(spread, spread))
    # The spread over blocks has an error of its own, and white noise is its least.
    assert np.all(np.abs(np.mean(ratios, axis=0) - 1.0) < 0.05)
    assert np.allclose(np.mean(correlations, axis=0), np.mean(scipys, axis=0), atol=0.05)
    assert np.min(ratios) > 0.97
    assert np.max(ratios) < 1.2


def test_intervals_hold_where_neighbours_are_alike_and_scipys_do_not():
    inside, scipys, draws = np.zeros(3), np.zeros(3), 100
    rng = np.random.default_rng(11)
    for _ in range(draws):
        noise = lfilter([0.02], [1.0, -0.9], rng.standard_normal(len(T) + 200))[200:]
        measured = decay(T, *TRUE) + noise
        found = solve(Derived(measured, np.arange(len(T)) // 20))
        low, high = found.intervals.T
        inside += (low <= TRUE) & (high >= TRUE)
        x, covariance = curve_fit(decay, T, measured, p0=TRUE)
        scipys += np.abs(x - TRUE) <= 1.96 * np.sqrt(np.diag(covariance))
    assert np.all(inside >= 0.85 * draws)
    assert np.all(scipys <= 0.75 * draws)


class Sum(Decay):
    """Only the sum of the first two numbers shows."""

    names = ("one", "other", "alone")
    start = np.array([0.5, 0.5, 0.0])
    priors = np.array([1.0, 1.0, 1.0])
    bounds = (np.full(3, -10.0), np.full(3, 10.0))

    def residual(self, x):
        return self.measured - (x[0] + x[1]) * T - x[2]


def test_what_cannot_be_told_apart_stays_and_says_from_what():
    measured = 3.0 * T + 1.0 + 0.05 * np.random.default_rng(0).standard_normal(len(T))
    found = solve(Sum(measured))
    assert found.determined.tolist() in ([True, False, True], [False, True, True])
    stays = int(np.flatnonzero(~found.determined)[0])
    assert found.x[stays] == 0.5
    assert found.ties == {Sum.names[stays]: [Sum.names[1 - stays]]}
    assert found.x[:2].sum() == pytest.approx(3.0, abs=0.02)
    # What the other may be widens the interval of the one that was fitted: nobody knows the split.
    low, high = found.intervals[1 - stays]
    assert high - low > 1.0
    low, high = found.intervals[2]
    assert high - low < 0.1
    assert [d.seen for d in found.directions] == [True, True, False]
    assert found.directions[-1].parts == pytest.approx({"one": math.sqrt(0.5), "other": -math.sqrt(0.5)}) or (
        found.directions[-1].parts == pytest.approx({"one": -math.sqrt(0.5), "other": math.sqrt(0.5)})
    )


def test_a_prior_counts_as_much_as_an_independent_measurement():
    class Mean(Decay):
        names = ("level",)
        start, priors = np.array([0.0]), np.array([0.02])
        bounds = (np.array([-5.0]), np.array([5.0]))

        def residual(self, x):
            return self.measured - x[0]

    measured = 0.05 + 0.2 * np.random.default_rng(4).standard_normal(len(T))
    found = solve(Mean(measured))
    # Of a normal mean: weights of the data, n / s^2, and of the prior, 1 / 0.02^2.
    data, prior = len(T) / measured.var(), 1 / 0.02**2
    assert found.x[0] == pytest.approx(measured.mean() * data / (data + prior), rel=0.05)


def test_a_bound_holds_and_a_failure_is_stepped_back_from():
    class Fails(Derived):
        bounds = (np.array([0.0, 0.0, 0.35]), np.array([10.0, 20.0, 10.0]))
        start = np.array([1.0, 2.0, 1.0])

        def residual(self, x):
            if x[1] > 3.0:
                raise ArithmeticError("too fast for this one")
            return super().residual(x)

    measured = decay(T, *TRUE) + 0.01 * np.random.default_rng(2).standard_normal(len(T))
    found = solve(Fails(measured))
    assert found.x[2] == pytest.approx(0.35, abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": np.array([11.0, 2.0, 0.0])}, "size: start 11 outside 0 to 10"),
        ({"priors": np.array([1.0, 0.0, 1.0])}, "rate: .*prior 0 not positive"),
        ({"names": ("size", "rate")}, "one length"),
        ({"blocks": np.zeros(len(T), dtype=int)}, "two blocks"),
        ({"blocks": np.arange(7)}, "one finite number for each"),
        ({"measured": np.full(len(T), np.nan)}, "finite"),
    ],
)
def test_a_problem_that_contradicts_itself_is_refused(changes, message):
    problem = Decay(decay(T, *TRUE))
    for name, value in changes.items():
        setattr(problem, name, value)
    with pytest.raises(InputError, match=message):
        solve(problem)
