"""Rodas4: its coefficients against the order conditions, and its contract with ``solve_ivp``."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hdsim.kernel import system as system_kernel
from hdsim.simulation import _rodas as c
from hdsim.simulation.rosenbrock import Rodas4, rodas4_through
from hdsim.system import System


def _tableau():
    """b (of u), alpha, Gamma in the book's notation, and the rows of the continuous extension."""
    a, minus = np.zeros((6, 6)), np.zeros((6, 6))
    a[1, :1] = c.A21
    a[2, :2] = c.A31, c.A32
    a[3, :3] = c.A41, c.A42, c.A43
    a[4, :4] = c.A51, c.A52, c.A53, c.A54
    a[5, :5] = c.A51, c.A52, c.A53, c.A54, 1.0
    minus[1, :1] = c.C21
    minus[2, :2] = c.C31, c.C32
    minus[3, :3] = c.C41, c.C42, c.C43
    minus[4, :4] = c.C51, c.C52, c.C53, c.C54
    minus[5, :5] = c.C61, c.C62, c.C63, c.C64, c.C65
    gamma = np.linalg.inv(np.eye(6) / c.GAMMA - minus)
    m = np.append(a[5, :5], 1.0)
    h2 = np.array([c.H21, c.H22, c.H23, c.H24, c.H25, 0.0])
    h3 = np.array([c.H31, c.H32, c.H33, c.H34, c.H35, 0.0])
    return m, a @ gamma, gamma, h2, h3


def _conditions(b, alpha, gamma):
    """Left-hand sides of the order conditions (the book, IV.7): the first four are those of order 3."""
    beta = alpha + gamma
    sum_alpha, sum_beta = alpha.sum(1), beta.sum(1)
    return np.array(
        [
            b.sum(),
            b @ sum_beta,
            b @ sum_alpha**2,
            b @ beta @ sum_beta,
            b @ sum_alpha**3,
            b @ (sum_alpha * (alpha @ sum_beta)),
            b @ beta @ sum_alpha**2,
            b @ beta @ beta @ sum_beta,
        ]
    )


RIGHT = np.array([1, 1 / 2, 1 / 3, 1 / 6, 1 / 4, 1 / 8, 1 / 12, 1 / 24])
POWER = np.array([1, 2, 3, 3, 4, 4, 4, 4])


def test_coefficients_satisfy_the_conditions_of_order_four():
    m, alpha, gamma, _, _ = _tableau()
    np.testing.assert_allclose(_conditions(m @ gamma, alpha, gamma), RIGHT, atol=2e-14)


def test_embedded_solution_has_order_three_and_not_four():
    m, alpha, gamma, _, _ = _tableau()
    error = abs(_conditions(np.append(m[:5], 0.0) @ gamma, alpha, gamma) - RIGHT)
    assert error[:4].max() < 2e-14
    assert error[4:].max() > 1e-3


def test_nodes_and_weights_of_time_are_the_row_sums():
    _, alpha, gamma, _, _ = _tableau()
    np.testing.assert_allclose(alpha.sum(1), [0.0, c.C2, c.C3, c.C4, 1.0, 1.0], atol=1e-14)
    np.testing.assert_allclose(gamma.sum(1), [c.D1, c.D2, c.D3, c.D4, 0.0, 0.0], atol=1e-14)


def test_method_is_stiffly_accurate_and_l_stable():
    m, alpha, gamma, _, _ = _tableau()
    beta = alpha + gamma
    np.testing.assert_allclose(m @ gamma, beta[5], atol=1e-14)
    b, one, unit = m @ gamma, np.ones(6), np.eye(6)
    assert abs(1.0 - b @ np.linalg.solve(beta, one)) < 1e-12
    for z in 1j * np.logspace(-2, 4, 200):
        assert abs(1.0 + z * (b @ np.linalg.solve(unit - z * beta, one))) <= 1.0 + 1e-12


@pytest.mark.parametrize("theta", [0.1, 0.5, 0.9])
def test_continuous_extension_satisfies_the_conditions_of_order_three(theta):
    m, alpha, gamma, h2, h3 = _tableau()
    weights = theta * m + theta * (1.0 - theta) * (h2 + theta * h3)
    found = _conditions(weights @ gamma, alpha, gamma)
    np.testing.assert_allclose(found[:4], (RIGHT * theta**POWER)[:4], atol=2e-14)


@system_kernel
def _pendulum(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """Driven pendulum whose last state is a quadrature, the work of the drive."""
    drive = reals[0] * math.cos(2.0 * t)
    dy[0] = y[1]
    dy[1] = drive - math.sin(y[0]) - 0.1 * y[1]
    dy[2] = drive * y[1]
    if want != 0:
        for i in range(9):
            jacobian[i] = 0.0
        jacobian[1] = 1.0
        jacobian[3] = -math.cos(y[0])
        jacobian[4] = -0.1
        jacobian[7] = drive
        rate = -2.0 * reals[0] * math.sin(2.0 * t)
        dfdt[0] = 0.0
        dfdt[1] = rate
        dfdt[2] = rate * y[1]


def pendulum(quadratures=1):
    return System(
        _pendulum, np.zeros(1, dtype=np.int64), np.array([0.8]), 1, np.array([1.0, 0.0, 0.0]), quadratures
    )


def solve(system, t1=20.0, **options):
    options = {"rtol": 1e-7, "atol": 1e-9, **options}
    return solve_ivp(system.rhs, (0.0, t1), system.y0, method=Rodas4, system=system, **options)


def test_leaving_quadratures_out_of_the_linear_algebra_changes_only_rounding():
    np.testing.assert_allclose(solve(pendulum(1)).y[:, -1], solve(pendulum(0)).y[:, -1], rtol=1e-10)


def test_result_does_not_depend_on_the_length_of_the_blocks():
    t = np.linspace(0.0, 20.0, 157)
    one = solve(pendulum(), t_eval=t, steps_per_call=1)
    for steps in (2, 7, 64, 100_000):
        other = solve(pendulum(), t_eval=t, steps_per_call=steps)
        np.testing.assert_array_equal(other.y, one.y)
        assert (other.nfev, other.njev, other.nlu) == (one.nfev, one.njev, one.nlu)


def test_work_is_counted():
    system = pendulum()
    calls = solve(system)
    solver = Rodas4(system.rhs, 0.0, system.y0, 20.0, system=system, rtol=1e-7, atol=1e-9)
    while solver.status == "running":
        solver.step()
    assert (calls.nfev, calls.njev, calls.nlu) == (solver.nfev, solver.njev, solver.nlu)
    assert solver.nlu == solver.steps + solver.rejected
    assert solver.njev == solver.steps
    # One for the Jacobian's point, five more an attempt, one for the choice of the first step.
    assert solver.nfev == solver.steps + 5 * solver.nlu + 1


def test_dense_output_outlives_the_steps_after_it():
    system = pendulum()
    found = solve(system, dense_output=True, steps_per_call=16)
    t = np.linspace(0.0, 20.0, 333)
    np.testing.assert_array_equal(found.sol(t), solve(system, t_eval=t, steps_per_call=16).y)
    assert found.sol(3.3).shape == (3,)
    np.testing.assert_allclose(found.sol(found.t), found.y, rtol=1e-14)


def test_samples_are_as_good_as_the_ends_of_the_steps():
    system, t = pendulum(), np.linspace(0.0, 20.0, 2001)
    reference = solve_ivp(
        system.rhs, (0.0, 20.0), system.y0, method="DOP853", t_eval=t, rtol=1e-12, atol=1e-13
    )
    for rtol in (1e-4, 1e-6, 1e-8):
        ends = solve(system, rtol=rtol, atol=rtol, steps_per_call=1)
        exact = solve_ivp(
            system.rhs, (0.0, 20.0), system.y0, method="DOP853", t_eval=ends.t, rtol=1e-12, atol=1e-13
        )
        at_ends = abs(ends.y - exact.y).max()
        between = abs(solve(system, rtol=rtol, atol=rtol, t_eval=t).y - reference.y).max()
        assert between < 2.0 * at_ends + 2.0 * rtol


def test_bare_loop_is_the_same_method():
    system, t = pendulum(), np.linspace(0.0, 20.0, 101)
    bare = rodas4_through(system, np.array([0.0, 20.0]), system.y0, t, rtol=1e-7, atol=1e-9)
    through_scipy = solve(system, t_eval=t)
    np.testing.assert_array_equal(bare.y, through_scipy.y)
    np.testing.assert_array_equal(bare.y_end, through_scipy.y[:, -1])
    assert bare.statistics.steps == through_scipy.njev


def test_large_dense_systems_are_solved_with_pivoting():
    # The kernel reads a full matrix from its reals: y' = M y.
    rng = np.random.default_rng(7)
    n = 30
    matrix = rng.normal(size=(n, n)) - 3.0 * np.eye(n)[::-1]
    matrix[np.diag_indices(n)] = 0.0
    system = System(_linear, np.array([n]), matrix.ravel(), 1, rng.normal(size=n))
    found = solve(system, t1=1.0, rtol=1e-9, atol=1e-11)
    from scipy.linalg import expm

    expected = expm(matrix) @ system.y0
    np.testing.assert_allclose(found.y[:, -1], expected, atol=1e-6 * abs(expected).max())


@system_kernel
def _linear(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """y' = M y."""
    n = integers[0]
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += reals[i * n + j] * y[j]
        dy[i] = total
    if want != 0:
        for i in range(n * n):
            jacobian[i] = reals[i]
        for i in range(n):
            dfdt[i] = 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"max_step": 0.0}, "max_step"),
        ({"first_step": -1.0}, "first_step"),
        ({"steps_per_call": 0}, "steps_per_call"),
        ({"rtol": -1e-3}, "rtol"),
        ({"atol": -1e-3}, "atol"),
    ],
)
def test_options_out_of_range_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        solve(pendulum(), **options)


def test_state_of_the_wrong_size_is_refused():
    system = pendulum()
    with pytest.raises(ValueError, match="2 states, the system 3"):
        solve_ivp(system.rhs, (0.0, 1.0), np.zeros(2), method=Rodas4, system=system)
