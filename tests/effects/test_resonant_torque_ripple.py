"""Torque ripple through a resonance, held against the filter that it is the steady response of."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hdsim.kernel as k
from hdsim.effects.motor_torque_ripple import MotorTorqueRipple, RippleComponent
from hdsim.effects.resonant_torque_ripple import ResonantComponent, ResonantTorqueRipple
from hdsim.testing.alone import Alone

ORDER, AMPLITUDE, PHASE = 12.0, 0.01, 35.0


def resonant(hertz: float, damping: float) -> Alone:
    component = ResonantComponent(order=ORDER, amplitude_nm=AMPLITUDE, phase_deg=PHASE)
    return Alone(
        ResonantTorqueRipple(components=(component,), natural_frequency_hz=hertz, damping_ratio=damping)
    )


def torque(model: Alone, angle: float, speed: float) -> float:
    place = model.initial
    place[k.MOTOR_ANGLE], place[k.MOTOR_VELOCITY] = angle, speed
    return float(model(place)[0][k.MOTOR_TORQUE])


def over_a_period(model: Alone, speed: float) -> complex:
    """Complex amplitude of the ripple, of a sine of the order with no phase."""
    angles = 2 * np.pi / ORDER * np.arange(64) / 64
    values = np.array([torque(model, angle, speed) for angle in angles])
    return complex(2j * np.mean(values * np.exp(-1j * ORDER * angles)))


@pytest.mark.parametrize(("hertz", "speed"), [(130.0, 0.01), (1e6, 80.0), (1e6, -80.0)])
def test_far_below_the_resonance_it_is_the_plain_ripple(hertz: float, speed: float) -> None:
    component = RippleComponent(order=ORDER, cogging_nm=AMPLITUDE, phase_deg=PHASE)
    plain = Alone(MotorTorqueRipple(components=(component,)))
    for angle in (0.1, 1.0, 2.3):
        assert torque(resonant(hertz, 0.4), angle, speed) == pytest.approx(
            torque(plain, angle, speed), abs=1e-3 * AMPLITUDE
        )


@pytest.mark.parametrize("damping", [0.05, 0.4, 1.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_at_the_resonance_it_is_one_over_twice_the_damping_and_a_quarter_late(
    damping: float, direction: float
) -> None:
    speed = direction * 2 * math.pi * 130.0 / ORDER
    wave = over_a_period(resonant(130.0, damping), speed)
    assert abs(wave) == pytest.approx(AMPLITUDE / (2 * damping))
    # Late in time, which is back in the angle for one direction and on for the other.
    late = -direction * (np.angle(wave) - math.radians(PHASE))
    assert math.remainder(late - math.pi / 2, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def filtered(
    seconds: float, acceleration: float, first: float, hertz: float, damping: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle, speed, and a sine of the angle behind w0^2 / (s^2 + 2 zeta w0 s + w0^2), integrated."""
    natural = 2 * math.pi * hertz

    def angle(t: float) -> float:
        return first * t + 0.5 * acceleration * t * t

    def rates(t: float, y: np.ndarray) -> list[float]:
        forced = AMPLITUDE * math.sin(ORDER * angle(t) + math.radians(PHASE))
        return [y[1], natural**2 * (forced - y[0]) - 2 * damping * natural * y[1]]

    times = np.linspace(0.3 * seconds, seconds, 800)
    found = solve_ivp(rates, (0.0, seconds), [0.0, 0.0], t_eval=times, rtol=1e-8, atol=1e-12)
    return np.array([angle(t) for t in times]), first + acceleration * times, found.y[0]


def test_the_filter_integrated_over_a_slow_run_up_agrees_and_over_a_fast_one_does_not() -> None:
    """From below through the resonance at 68 rad/s: an error of the order of (speed's change) / (zeta w0)."""
    model = resonant(130.0, 0.4)

    def worst(seconds: float) -> float:
        angles, speeds, exact = filtered(seconds, 90.0 / seconds, 10.0, 130.0, 0.4)
        values = np.array([torque(model, a, w) for a, w in zip(angles, speeds, strict=True)])
        return float(np.max(np.abs(values - exact))) / AMPLITUDE

    slow, fast = worst(4.0), worst(0.04)
    assert slow < 0.02
    assert fast > 10 * slow
