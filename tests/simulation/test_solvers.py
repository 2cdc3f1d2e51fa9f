"""What ``integrate`` promises whatever happens inside: the last good state, all samples, a clear message."""

import math
import threading

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hdsim.errors import InputError
from hdsim.kernel import system as system_kernel
from hdsim.simulation.rosenbrock import Rodas4
from hdsim.simulation.solvers import METHODS, Statistics, integrate
from hdsim.system import System

every_method = pytest.mark.parametrize("method", METHODS)


@system_kernel
def _oscillator(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """x'' = -w^2 x; not a number from t = reals[1] on, or beyond |x| = reals[2]."""
    w = reals[0]
    dy[0] = y[1]
    dy[1] = -w * w * y[0]
    if t > reals[1] or abs(y[0]) > reals[2]:
        dy[1] = math.nan
    if want != 0:
        jacobian[0] = 0.0
        jacobian[1] = 1.0
        jacobian[2] = -w * w
        jacobian[3] = 0.0
        dfdt[0] = 0.0
        dfdt[1] = 0.0


@system_kernel
def _explosion(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """y' = y^2, infinite at t = 1 / y0."""
    dy[0] = y[0] * y[0]
    if want != 0:
        jacobian[0] = 2.0 * y[0]
        dfdt[0] = 0.0


@system_kernel
def _forced(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """x'' = -100 x + a(t), a linear between its corners."""
    n = integers[0]
    k = min(max(int(t * (n - 1) / reals[n - 1]), 0), n - 2)
    slope = (reals[n + k + 1] - reals[n + k]) / (reals[k + 1] - reals[k])
    dy[0] = y[1]
    dy[1] = -100.0 * y[0] + reals[n + k] + slope * (t - reals[k])
    if want != 0:
        jacobian[0] = 0.0
        jacobian[1] = 1.0
        jacobian[2] = -100.0
        jacobian[3] = 0.0
        dfdt[0] = 0.0
        dfdt[1] = slope


def oscillator(w=10.0, bad_time=1e9, bad_position=1e9):
    return System(
        _oscillator,
        np.zeros(1, dtype=np.int64),
        np.array([w, bad_time, bad_position]),
        1,
        np.array([1.0, 0.0]),
        scale=np.array([1.0, w]),
    )


def explosion():
    return System(_explosion, np.zeros(1, dtype=np.int64), np.zeros(1), 1, np.ones(1), scale=np.ones(1))


@every_method
def test_samples_end_state_and_work_are_reported(method):
    system = oscillator()
    t = np.array([0.1, 0.25, 0.6])
    found = integrate(system, 0.0, 1.0, system.y0, method=method, rtol=1e-7, t_eval=t)
    assert (found.success, found.message, found.exception) == (True, "", None)
    np.testing.assert_array_equal(found.t, t)
    np.testing.assert_allclose(found.y[0], np.cos(10.0 * t), atol=1e-4)
    assert found.t_end == 1.0
    np.testing.assert_allclose(found.y_end, [math.cos(10.0), -10.0 * math.sin(10.0)], atol=1e-3)
    assert found.statistics.nfev > found.statistics.steps > 3
    assert all(type(value) is int for value in vars(found.statistics).values())


@every_method
def test_without_sample_times_the_first_and_last_points_are_there(method):
    system = oscillator()
    found = integrate(system, 0.0, 0.5, system.y0, method=method)
    assert found.t[0] == 0.0
    assert found.t[-1] == 0.5
    np.testing.assert_array_equal(found.y[:, -1], found.y_end)


@every_method
def test_no_sample_in_the_span_still_gives_the_end(method):
    system = oscillator()
    found = integrate(system, 0.0, 0.01, system.y0, method=method, t_eval=np.empty(0))
    assert found.success
    assert found.y.shape == (2, 0)
    assert found.y_end[0] == pytest.approx(math.cos(0.1), abs=1e-4)


@every_method
def test_integration_backwards_returns_to_the_start(method):
    system = oscillator()
    there = integrate(system, 0.0, 0.7, system.y0, method=method, rtol=1e-8)
    t = np.linspace(0.7, 0.0, 15)
    back = integrate(system, 0.7, 0.0, there.y_end, method=method, rtol=1e-8, t_eval=t)
    assert back.t_end == 0.0
    np.testing.assert_allclose(back.y[0], np.cos(10.0 * t), atol=1e-4)


@every_method
def test_an_empty_span_changes_nothing(method):
    system = oscillator()
    found = integrate(system, 0.3, 0.3, system.y0, method=method, first_step=0.1)
    assert found.success
    np.testing.assert_array_equal(found.y_end, system.y0)


@every_method
@pytest.mark.filterwarnings("ignore:lsoda")
def test_right_hand_side_that_turns_bad_stops_the_run_and_keeps_what_was_computed(method):
    system = oscillator(bad_time=0.5)
    t = np.linspace(0.0, 1.0, 101)
    found = integrate(system, 0.0, 1.0, system.y0, method=method, t_eval=t)
    assert not found.success
    assert "t = 0." in found.message
    assert 0.3 < found.t_end <= 0.5 + 1e-6
    assert np.isfinite(found.y_end).all()
    assert len(found.t) == np.count_nonzero(t <= found.t_end)
    np.testing.assert_allclose(found.y[0], np.cos(10.0 * found.t), atol=1e-3)


def test_the_default_method_names_the_cause_and_the_state():
    system = oscillator(bad_time=0.5)
    found = integrate(system, 0.0, 1.0, system.y0)
    assert found.message.startswith("The right-hand side or its Jacobian is not finite. Stopped at t = 0.5")
    assert found.suspect == 1
    assert found.t_end == pytest.approx(0.5, abs=1e-9)


def test_a_bad_trial_point_alone_does_not_stop_the_default_method():
    # The first trial step overshoots into the bad region; the solution itself never goes there.
    system = oscillator(bad_position=1.0 + 1e-3)
    found = integrate(system, 0.0, 2.0, system.y0, rtol=1e-6, first_step=1.0)
    assert found.success
    assert found.statistics.rejected > 0


@every_method
def test_bad_from_the_start_fails_at_once(method):
    system = oscillator(bad_time=-1.0)
    found = integrate(system, 0.0, 1.0, system.y0, method=method, t_eval=np.array([0.5]))
    assert not found.success
    assert found.suspect == 1
    assert "not finite" in found.message
    assert "t = 0 s" in found.message
    np.testing.assert_array_equal(found.y_end, system.y0)
    assert found.y.shape == (2, 0)


@every_method
def test_initial_state_that_is_not_finite_is_refused_in_words(method):
    system = oscillator()
    found = integrate(system, 0.0, 1.0, np.array([0.0, math.nan]), method=method)
    assert not found.success
    assert found.suspect == 1
    assert found.message.startswith("The initial state is not finite")


@every_method
@pytest.mark.filterwarnings("ignore:lsoda")
def test_a_solution_that_escapes_to_infinity_ends_with_a_message(method):
    system = explosion()
    found = integrate(system, 0.0, 2.0, system.y0, method=method, t_eval=np.linspace(0.0, 2.0, 41))
    assert not found.success
    assert "t = " in found.message
    assert 0.9 < found.t_end < 1.01
    assert np.isfinite(found.y).all()
    inside = found.t < 0.9
    np.testing.assert_allclose(found.y[0, inside], 1.0 / (1.0 - found.t[inside]), rtol=1e-3)


@every_method
def test_progress_is_called_after_every_step_with_the_time_reached(method):
    system, seen = oscillator(), []
    found = integrate(
        system, 0.0, 3.0, system.y0, method=method, on_step=lambda t, y: seen.append((t, y.copy()))
    )
    times = [t for t, _ in seen]
    assert times == sorted(set(times))
    assert times[-1] == 3.0
    np.testing.assert_array_equal(seen[-1][1], found.y_end)


@every_method
@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("disk full")])
def test_an_exception_while_reporting_keeps_everything_up_to_there(method, error):
    system, t = oscillator(), np.linspace(0.0, 30.0, 301)

    def report(time, y):
        if time > 2.0:
            raise error

    found = integrate(system, 0.0, 30.0, system.y0, method=method, t_eval=t, on_step=report)
    assert not found.success
    assert found.exception is error
    assert 2.0 < found.t_end < 30.0
    assert f"t = {found.t_end:.9g} s" in found.message
    assert ("Interrupted" if isinstance(error, KeyboardInterrupt) else "disk full") in found.message
    assert len(found.t) == np.count_nonzero(t <= found.t_end)


@every_method
def test_the_next_span_can_start_with_the_last_step(method):
    system = oscillator()
    first = integrate(system, 0.0, 1.0, system.y0, method=method)
    assert (first.next_step is not None) == METHODS[method].one_step
    if first.next_step is None:
        return
    assert 1e-4 < first.next_step < 1.0
    second = integrate(system, 1.0, 2.0, first.y_end, method=method, first_step=first.next_step)
    fresh = integrate(system, 1.0, 2.0, first.y_end, method=method)
    assert second.statistics.nfev <= fresh.statistics.nfev


@pytest.mark.parametrize("method", [name for name, method in METHODS.items() if method.one_step])
def test_a_short_span_does_not_forget_the_step(method):
    system = oscillator()
    step = integrate(system, 0.0, 1.0, system.y0, method=method).next_step
    y = system.y0
    for i in range(100):
        found = integrate(system, i * 1e-6, (i + 1) * 1e-6, y, first_step=step, method=method)
        y, step = found.y_end, found.next_step
    assert step > 1e-3
    assert found.statistics.steps == 1


def test_largest_step_is_kept():
    system = oscillator()
    found = integrate(system, 0.0, 1.0, system.y0, max_step=1e-3, rtol=1e-3)
    assert found.statistics.steps >= 1000
    assert found.next_step <= 1e-3


def test_statistics_of_spans_add_up():
    total = Statistics()
    total.add(Statistics(1, 2, 3, 4, 5))
    total.add(Statistics(10, 20, 30, 40, 50))
    assert total == Statistics(11, 22, 33, 44, 55)


def test_unknown_method_is_answered_with_the_known_ones():
    with pytest.raises(InputError, match="rodas4, RK45"):
        integrate(oscillator(), 0.0, 1.0, np.zeros(2), method="euler")


def test_absolute_tolerance_is_asked_for_when_the_system_has_no_scale():
    system = oscillator()
    system.scale = np.zeros(0)
    with pytest.raises(InputError, match="absolute tolerance"):
        integrate(system, 0.0, 1.0, system.y0)


def test_initial_state_of_the_wrong_shape_is_refused():
    with pytest.raises(InputError, match="2 states"):
        integrate(oscillator(), 0.0, 1.0, np.zeros(3))


def test_runs_in_threads_give_the_same_bits():
    t = np.linspace(0.0, 20.0, 201)
    expected = integrate(oscillator(), 0.0, 20.0, np.array([1.0, 0.0]), t_eval=t).y
    results = {}

    def work(i):
        results[i] = integrate(oscillator(), 0.0, 20.0, np.array([1.0, 0.0]), t_eval=t).y

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for i in range(4):
        np.testing.assert_array_equal(results[i], expected)


@pytest.mark.parametrize("span", [(0.0, 1.0), (1.0, 0.0)], ids=["forward", "backward"])
@pytest.mark.parametrize("steps_per_call", [1, 64])
def test_steps_end_at_the_stops(span, steps_per_call):
    system = oscillator()
    stops = np.array([-1.0, 0.0, 0.1, 0.1 + 1e-9, 1.0 / 3.0, 0.9, 1.0, 2.0])
    found = solve_ivp(system.rhs, span, system.y0, method=Rodas4, system=system, rtol=1e-9, atol=1e-9,
                      stops=stops, steps_per_call=steps_per_call, dense_output=True)  # fmt: skip
    ends = np.concatenate([each._record[0] for each in found.sol.interpolants])
    assert set(stops[1:-1]) <= set(ends)
    assert found.t[-1] == span[1]
    np.testing.assert_allclose(found.y[0, -1], np.cos(10.0), rtol=1e-6)


def test_no_step_is_rejected_at_a_corner_of_the_forcing_that_is_a_stop():
    # x'' = -w^2 x + a(t), a piecewise linear: what a motion that is a cubic spline does to a drive.
    corners = np.linspace(0.0, 10.0, 101)
    system = System(
        _forced, np.array([len(corners)]), np.concatenate([corners, np.cos(7.0 * corners**2)]), 1,
        np.array([1.0, 0.0]), scale=np.array([1.0, 10.0]),
    )  # fmt: skip
    across, cut = (integrate(system, 0.0, 10.0, system.y0, rtol=1e-7, stops=s) for s in (None, corners))
    assert cut.statistics.rejected < 0.1 * across.statistics.rejected
    assert cut.statistics.steps < across.statistics.steps
    np.testing.assert_allclose(cut.y_end, across.y_end, atol=1e-4)
