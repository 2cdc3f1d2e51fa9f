"""Every method on every system with a known solution; before that, that those solutions are right."""

import numpy as np
import pytest
from analytic_systems import ALL, SMOOTH, CoulombCorner, ForcedBacklash, ProtheroRobinson, TwoMassResonance
from scipy.integrate import solve_ivp

from hdsim.simulation.rosenbrock import Rodas4
from hdsim.simulation.solvers import METHODS, integrate

# Error over the whole run, in units of rtol times the size of the state: (smooth, with kinks). The local
# error of a step is held to the tolerance, so what adds up over 50 to 500 steps is some ten times that;
# multistep methods control less sharply. RK45 and DOP853 estimate the error from stages that can all miss a
# kink, and no method sees a step over one as sharply as a smooth one.
FACTORS = {
    "rodas4": (20, 200),
    "RK45": (60, 5000),
    "DOP853": (100, 1500),
    "Radau": (20, 100),
    "BDF": (300, 2000),
    "LSODA": (60, 1000),
}
# Between the steps of a stiff run a collocation polynomial is no better than its step is short.
STIFF_INTERPOLATION = {"Radau": 1500}

by_name = pytest.mark.parametrize("case", ALL, ids=lambda case: case.name)


@by_name
def test_exact_solution_solves_the_equation(case):
    system = case.system()
    t = np.linspace(0.0, case.t_end, 61)
    np.testing.assert_allclose(case.exact(t[:1])[:, 0], system.y0, atol=1e-12)
    # An independent method at its tightest; the step is small enough not to jump over a kink.
    found = solve_ivp(
        system.rhs,
        (0.0, case.t_end),
        system.y0,
        method="DOP853",
        t_eval=t,
        rtol=1e-12,
        atol=1e-13,
        max_step=case.t_end / (100 if case.smooth else 1000),
    )
    error = abs(found.y - case.exact(t)) / system.scale[:, None]
    assert error.max() < (1e-9 if case.smooth else 1e-6)


@by_name
def test_derivatives_of_the_kernels_are_exact(case):
    system = case.system()
    t, step = 0.37 * case.t_end, 1e-6
    y = case.exact(np.array([t]))[:, 0]
    _, jacobian, dfdt = system.evaluate(t, y)
    size = 1.0 + abs(jacobian).max()
    for column in range(system.size):
        shift = np.zeros(system.size)
        shift[column] = step
        slope = (system.rhs(t, y + shift) - system.rhs(t, y - shift)) / (2 * step)
        np.testing.assert_allclose(jacobian[:, column], slope, atol=1e-7 * size)
    slope = (system.rhs(t + step, y) - system.rhs(t - step, y)) / (2 * step)
    np.testing.assert_allclose(dfdt, slope, atol=1e-7 * (1.0 + abs(dfdt).max()))


def test_forced_backlash_crosses_both_flanks_many_times():
    assert ForcedBacklash().crossings >= 10


@pytest.mark.parametrize("method", METHODS)
@by_name
def test_method_meets_its_tolerance(case, method):
    system, rtol = case.system(), 1e-6
    t = np.linspace(0.0, case.t_end, 301)
    found = integrate(system, 0.0, case.t_end, system.y0, method=method, rtol=rtol, t_eval=t)
    assert found.success
    assert found.t_end == case.t_end
    np.testing.assert_array_equal(found.t, t)
    factor = FACTORS[method][0 if case.smooth else 1]
    end = abs(found.y_end - case.exact(t[-1:])[:, 0]) / system.scale
    assert end.max() < factor * rtol
    if isinstance(case, ProtheroRobinson):
        factor = STIFF_INTERPOLATION.get(method, factor)
    assert (abs(found.y - case.exact(t)) / system.scale[:, None]).max() < factor * rtol


@by_name
def test_tighter_tolerance_gives_smaller_error(case):
    system = case.system()
    error = []
    for rtol in (1e-4, 1e-8):
        found = integrate(system, 0.0, case.t_end, system.y0, rtol=rtol)
        error.append((abs(found.y_end - case.exact(np.array([case.t_end]))[:, 0]) / system.scale).max())
    assert error[1] < 1e-2 * error[0]


@pytest.mark.parametrize("rate", [-1e2, -1e4, -1e6, -1e8])
def test_stiffness_does_not_cost_steps(rate):
    case = ProtheroRobinson(rate)
    system = case.system()
    found = integrate(system, 0.0, case.t_end, system.y0, rtol=1e-5)
    assert abs(found.y_end[0] - np.sin(case.t_end)) < 1e-4
    assert found.statistics.steps < 150


def test_two_mass_solution_conserves_energy():
    case = TwoMassResonance()
    y = case.exact(np.linspace(0.0, case.t_end, 50))
    energy = 0.5 * case.j1 * y[2] ** 2 + 0.5 * case.j2 * y[3] ** 2 + 0.5 * case.k * (y[0] - y[1]) ** 2 + y[4]
    np.testing.assert_allclose(energy, energy[0], rtol=1e-12)


def test_event_ends_the_span_at_the_coulomb_corner():
    case = CoulombCorner()
    system = case.system()

    def stopped(t, y):
        return y[1]

    stopped.terminal, stopped.direction = True, -1
    found = solve_ivp(
        system.rhs,
        (0.0, 1.0),
        system.y0,
        method=Rodas4,
        system=system,
        steps_per_call=1,
        rtol=1e-9,
        atol=1e-12,
        events=stopped,
    )
    time, angle = case.stop
    assert found.status == 1
    assert found.t[-1] == pytest.approx(time, rel=1e-8)
    assert found.y[0, -1] == pytest.approx(angle, rel=1e-8)


def _fixed_step_error(case, steps, at_ends):
    """Largest scaled error with ``steps`` equal steps, at their ends or between them."""
    system = case.system()
    h = case.t_end / steps
    t = np.linspace(0.0, case.t_end, steps + 1)
    if not at_ends:
        t = (t[:-1, None] + h * np.array([0.2, 0.5, 0.8])).ravel()
    found = solve_ivp(
        system.rhs,
        (0.0, case.t_end),
        system.y0,
        method=Rodas4,
        system=system,
        t_eval=t,
        rtol=1e9,
        atol=1e9,
        first_step=h,
        max_step=h,
    )
    assert found.nlu == steps
    return (abs(found.y - case.exact(t)) / system.scale[:, None]).max()


@pytest.mark.parametrize("case", SMOOTH, ids=lambda case: case.name)
def test_rodas4_has_order_four_at_the_steps_and_between_them(case):
    coarse, fine = 400, 1600
    order = {}
    for at_ends in (True, False):
        ratio = _fixed_step_error(case, coarse, at_ends) / _fixed_step_error(case, fine, at_ends)
        order[at_ends] = np.log(ratio) / np.log(fine / coarse)
    assert order[True] == pytest.approx(4.0, abs=0.2)
    # An extension of order 3: its error is one of order 4 in each step, and does not add up.
    assert order[False] == pytest.approx(4.0, abs=0.2)
