"""Hysteresis alone: loops, Masing's and Rayleigh's laws, the Duhem branch."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from operating_point import ARCMIN
from scipy.integrate import solve_ivp

import hdsim.kernel as k
from hdsim.effects.torsional_hysteresis_duhem import TorsionalHysteresisDuhem
from hdsim.effects.torsional_hysteresis_maxwell import SlipElement, TorsionalHysteresisMaxwell
from hdsim.testing.alone import Alone


def cycle(
    effect: TorsionalHysteresisMaxwell, amplitude: float, rate: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Twist and torque over two triangle cycles from rest, 400 samples a quarter, shape (n,) each."""
    model = Alone(effect)
    corners = amplitude * np.array([0, 1, 0, -1, 0, 1, 0, -1, 0.0])
    own, twist, torque = model.initial[k.OWN :], [0.0], [0.0]
    for start, stop in pairwise(corners):
        way = np.linspace(0, 1, 401)
        speed = rate * (stop - start)

        def slope(t: float, y: np.ndarray, speed: float = speed) -> np.ndarray:
            inputs = model.initial
            inputs[k.TWIST_RATE], inputs[k.OWN :] = speed, y
            return model(inputs)[0][k.OWN :]

        step = (
            0.005 / rate
        )  # a sharp element's slip lies between two steps of a solver that sees a straight line
        solved = solve_ivp(
            slope, (0, 1 / rate), own, "LSODA", way / rate, rtol=1e-9, atol=1e-9, max_step=step
        )
        own = solved.y[:, -1]
        twist += list(start + (stop - start) * way[1:])
        torque += list(solved.y.sum(axis=0)[1:])
    return np.array(twist), np.array(torque)


def test_maxwell_loop_has_the_area_of_ideal_elastoplastic_elements() -> None:
    elements = [(8000.0, 0.8), (3000.0, 0.9)]
    given = tuple(SlipElement(stiffness_nm_per_rad=a, slip_torque_nm=b) for a, b in elements)
    amplitude = 1e-3
    ideal = sum(4 * w * (amplitude - w / s) for s, w in elements)
    for sharpness, tolerance in ((12.0, 0.02), (200.0, 0.001)):
        x, f = cycle(TorsionalHysteresisMaxwell(elements=given, sharpness=sharpness), amplitude)
        area = abs(np.trapezoid(f[1600:], x[1600:]))  # second cycle: x and F close
        assert area == pytest.approx(ideal, rel=tolerance)


def test_maxwell_is_rate_independent_and_never_exceeds_its_slip_torque() -> None:
    effect = TorsionalHysteresisMaxwell()
    slow, fast = cycle(effect, 2e-3, 1.0)[1], cycle(effect, 2e-3, 1000.0)[1]
    assert np.allclose(slow, fast, atol=1e-5)
    assert 0.99 * 2.0 < np.abs(slow).max() < 2.0 + 1e-8


@pytest.mark.parametrize(("sharpness", "tolerance"), [(12, 0.03), (200, 0.002)])
def test_maxwell_obeys_masing(sharpness: float, tolerance: float) -> None:
    """After a reversal the branch is the virgin curve, doubled in both directions (Masing 1926)."""
    effect = TorsionalHysteresisMaxwell(sharpness=sharpness)
    x, f = cycle(effect, 1e-3)
    virgin_x, virgin_f = x[:401], f[:401]
    branch_x, branch_f = x[400:1201], f[400:1201]
    expected = virgin_f[-1] - 2 * np.interp((branch_x[0] - branch_x) / 2, virgin_x, virgin_f)
    assert np.abs(branch_f - expected).max() < tolerance * 2.0


@pytest.mark.parametrize(("count", "tolerance"), [(9, 0.02), (60, 0.003)])
def test_maxwell_shares_that_grow_with_the_square_of_the_twist_are_rayleighs_law(
    count: int, tolerance: float
) -> None:
    """Torque of the sliders at phi in proportion to phi dphi: a virgin curve W (2 u - u^2), u = x/phi_m.

    In a geometric series of twists dphi is in proportion to phi. A parabola's loops, by Masing, are those of
    Rayleigh 1887 (Philosophical Magazine 23:225): heat 4/3 nu x^3 in a cycle of amplitude x, nu = W/phi_m^2.
    """
    torque, last = 3.0, 0.8
    # Each slider stands for the twists around it, the last one for those below it alone.
    ratio = (last / 0.01) ** (1 / count) if count > 9 else math.sqrt(2.0)
    twists = tuple(last * ratio ** -(k + 0.5) for k in range(count))
    effect = TorsionalHysteresisMaxwell(slip_torque_nm=torque, slip_twists_mrad=twists, share_exponent=2.0)
    amplitude = 0.6e-3
    x, f = cycle(effect, amplitude)
    u = x[:401] / (1e-3 * last)
    assert np.abs(f[:401] - torque * (2 * u - u**2)).max() < tolerance * torque
    heat = 4 / 3 * torque / (1e-3 * last) ** 2 * amplitude**3
    assert abs(np.trapezoid(f[1600:], x[1600:])) == pytest.approx(heat, rel=2 * tolerance)


def test_maxwell_shares_are_of_the_whole_slip_torque() -> None:
    effect = TorsionalHysteresisMaxwell(slip_torque_nm=3.0, slip_twists_mrad=(0.1, 0.4), share_exponent=0.5)
    small, large = effect.slip_elements()
    assert small.slip_torque_nm + large.slip_torque_nm == pytest.approx(3.0, rel=1e-12)
    assert large.slip_torque_nm / small.slip_torque_nm == pytest.approx(2.0, rel=1e-12)
    assert large.slip_torque_nm / large.stiffness_nm_per_rad == pytest.approx(0.4e-3, rel=1e-12)


def test_maxwell_default_stays_within_the_catalogues_hysteresis_loss() -> None:
    """Below 1 arcmin of width at zero torque over K1 = 1.6e4 N m/rad: 2 sum W < 4.65 N m."""
    x, f = cycle(TorsionalHysteresisMaxwell(), 2.1e-3)
    up = np.interp(0.0, x[2000:2801][::-1], f[2000:2801][::-1])
    assert 2 * abs(up) < ARCMIN * 1.6e4


def test_duhem_branch_is_the_exponential() -> None:
    model = Alone(TorsionalHysteresisDuhem(stiffness_nm_per_rad=4000, saturation_torque_nm=2))
    times = np.linspace(0, 1, 20)
    z = model.follow(k.TWIST, lambda t: 1e-3 * t, lambda t: 1e-3, times)[0]
    assert np.allclose(z, 2 * (1 - np.exp(-2000 * 1e-3 * times)), atol=1e-7)
    slower = model.follow(k.TWIST, lambda t: 1e-5 * t, lambda t: 1e-5, 100 * times)[0]
    assert np.allclose(z, slower, atol=1e-6)
    by_twist = Alone(TorsionalHysteresisDuhem(saturation_torque_nm=2, saturation_twist_mrad=0.5))
    assert np.allclose(by_twist.follow(k.TWIST, lambda t: 1e-3 * t, lambda t: 1e-3, times)[0], z, atol=1e-9)


def test_duhem_of_exponent_two_loads_along_a_hyperbolic_tangent_and_unloads_along_a_tangent() -> None:
    """The solutions of dz/dx = A (1 -+ (z/z_s)^2) on both sides of a reversal."""
    model = Alone(TorsionalHysteresisDuhem(saturation_torque_nm=2, saturation_twist_mrad=0.5, exponent=2))
    times = np.linspace(0, 1, 40)
    up, down = times <= 0.5, times > 0.5
    z = model.follow(
        k.TWIST, lambda t: 1e-3 * min(t, 1 - t), lambda t: 1e-3 * (1 if t <= 0.5 else -1), times
    )[0]
    top = 2 * math.tanh(1.0)
    assert np.allclose(z[up], 2 * np.tanh(times[up] / 0.5), atol=1e-4)
    back = np.arctan(top / 2) - (times[down] - 0.5) / 0.5
    # Below zero the torque rises again along the hyperbolic tangent.
    expected = np.where(back > 0, 2 * np.tan(back), 2 * np.tanh(back))
    assert np.allclose(z[down], expected, atol=1e-3)
