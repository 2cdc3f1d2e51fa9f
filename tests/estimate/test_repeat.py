"""What repeats from turn to turn: of known mixtures the share is that of their powers."""

import numpy as np
import pytest

from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record
from hdsim.estimate.repeat import repeating

TIME = np.arange(8000) * 1e-3
#: Both ways, up to 94 rad/s: 38 turns there and back.
ANGLE = 60.0 * (1 - np.cos(0.5 * np.pi * TIME)) + 3.0 * TIME
NOISE = 0.004


def told(torque, angle=ANGLE, age_s=0.0, seed=0):
    """The share and its interval of a torque with white noise."""
    torque = torque + NOISE * np.random.default_rng(seed).standard_normal(len(TIME))
    record = Record("r", TIME, {"motor_angle": angle, "motor_torque": torque})
    return repeating(Bench(predictors([record], -100.0)), "motor_torque", [torque], age_s)


@pytest.mark.parametrize("seed", range(5))
def test_noise_does_not_repeat(seed):
    share, (low, _) = told(np.zeros(len(TIME)), seed=seed)
    assert share < 0.05
    assert low == 0.0


@pytest.mark.parametrize("amplitude", [0.002, 0.006, 0.02])
@pytest.mark.parametrize("order", [1, 2, 1.98, 12])
def test_an_order_repeats_by_its_part_of_the_power(order, amplitude):
    share, (low, high) = told(amplitude * np.sin(order * ANGLE + 0.3))
    power = 0.5 * amplitude**2
    assert share == pytest.approx(power / (power + NOISE**2), abs=0.05)
    assert low < share < high


def test_a_law_of_the_speed_repeats():
    speed = np.gradient(ANGLE, TIME)
    torque = 0.01 * np.tanh(speed / 20.0)
    share, _ = told(torque)
    # Less near the reversals, where the speed changes within a turn.
    assert share == pytest.approx(np.mean(torque**2) / (np.mean(torque**2) + NOISE**2), abs=0.08)


def test_vibration_does_not_repeat():
    # 37 Hz at speeds that vary: as many as the turns are, its phases.
    share, _ = told(0.01 * np.sin(2 * np.pi * 37.0 * TIME))
    assert share < 0.1


def test_a_late_reading_of_a_high_order_repeats_where_its_age_is_known():
    then = np.interp(TIME - 4e-3, TIME, ANGLE)
    torque = 0.02 * np.sin(12 * then)
    known, _ = told(torque, age_s=4e-3)
    blurred, _ = told(torque)
    assert known > 0.85
    assert blurred < known - 0.03


def test_less_than_a_turn_tells_nothing():
    angle = 3.0 * np.sin(TIME)
    assert told(np.sin(angle), angle=angle) is None
