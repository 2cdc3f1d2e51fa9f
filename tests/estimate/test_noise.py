"""Noise of channels: white, quantised, and what falls out of the difference of two encoders."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.estimate.bench import Bench
from hdsim.estimate.noise import noise_floor, quantisation_step, without_orders
from hdsim.estimate.predict import Predictor, plan_for, predictors
from hdsim.estimate.records import Record

JOINT = Path(__file__).parents[3] / "shared" / "data" / "lara8-joint3-dual-encoder" / "joint3.csv"
ALL = np.ones(6000, dtype=bool)


def slow(seed: int, n: int = 6000) -> np.ndarray:
    """A motion that needs many samples for a step of its encoder."""
    phase = np.random.default_rng(seed).uniform(0, 6)
    return 0.3 * np.sin(2 * np.pi * 0.2 * np.arange(n) / 1000.0 + phase)


@settings(max_examples=30, deadline=None)
@given(st.floats(1e-6, 1e-2), st.integers(0, 1000))
def test_a_step_is_found_from_the_readings_alone(step, seed):
    values = np.round(slow(seed) / step) * step
    assert quantisation_step(values) == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize("step", [1e-5, 1e-4, 1e-3])
def test_a_step_is_found_in_readings_that_were_rounded_again(step):
    values = np.round(slow(2) / step) * step
    single = values.astype(np.float32).astype(float)
    shaken = values * (1.0 + 1e-9 * np.random.default_rng(5).standard_normal(6000))
    assert quantisation_step(single) == pytest.approx(step, rel=0.01)
    assert quantisation_step(shaken) == pytest.approx(step, rel=0.01)


def test_continuous_readings_have_no_step():
    values = slow(1) + 1e-4 * np.random.default_rng(0).standard_normal(6000)
    assert quantisation_step(values) == 0.0


@pytest.mark.parametrize("step_over_noise", [0.05, 0.3, 1.0, 3.0, 10.0, 100.0])
def test_noise_of_a_quantised_sensor_is_that_of_its_error(step_over_noise):
    """An encoder whose step is larger than its noise reads the same number for long: that is no silence."""
    spread, rng = 2e-5, np.random.default_rng(3)
    step = step_over_noise * spread
    true = slow(3)
    values = np.round((true + spread * rng.standard_normal(len(true))) / step) * step
    assert noise_floor(values, ALL) == pytest.approx(float(np.std(values - true)), rel=0.35)


def test_a_slow_record_of_a_fast_motion_is_not_taken_for_noise():
    t = np.arange(3000) / 100.0
    values = np.sin(2 * np.pi * 4.0 * t) + 1e-4 * np.random.default_rng(2).standard_normal(3000)
    assert noise_floor(values, np.ones(3000, dtype=bool)) < 1e-3


def both_encoders(jitter_s: float) -> Record:
    """A drive of ratio 100 at 40 rad/s whose samples are taken at other times than the stamps say."""
    rng = np.random.default_rng(5)
    stamps = np.arange(4000) / 500.0
    taken = stamps + jitter_s * rng.standard_normal(4000)
    motor = 40.0 * taken + 30.0 * np.sin(taken)
    error = 1.2e-5 * np.sin(2.0 * motor)
    output = motor / 100.0 + error + 2e-6 * rng.standard_normal(4000)
    return Record("joint", stamps, {"motor_angle": motor, "output_angle": output})


def test_with_both_encoders_the_jitter_of_the_clock_falls_out():
    record = both_encoders(3e-4)
    alone = noise_floor(record.channels["output_angle"], np.ones(4000, dtype=bool))
    predictor = Predictor(record, plan_for(record), 100.0)
    measured, _, noise, _ = predictor.measured("output_angle")
    assert alone > 5e-5
    assert noise < 0.2 * alone
    # What is compared is the transmission error beside the smooth motion: order 2 at 1.2e-5 rad is seen.
    error = measured - predictor.motor_angle / 100.0
    wave = np.exp(-2j * predictor.motor_angle)
    assert 2.0 * abs(np.mean((error - error.mean()) * wave)) == pytest.approx(1.2e-5, rel=0.1)


def test_without_jitter_the_output_is_compared_as_it_reads():
    record = both_encoders(0.0)
    record.channels["motor_angle"] = np.round(record.channels["motor_angle"] / 0.05) * 0.05
    measured, _, _, _ = Predictor(record, plan_for(record), 100.0).measured("output_angle")
    assert measured is record.channels["output_angle"]


def test_held_out_records_are_weighed_as_their_channel():
    """A held-out record in SI units would let its newton metres drown its radians."""
    bench = Bench(predictors([both_encoders(0.0)], 100.0), predictors([both_encoders(0.0)], 100.0))
    rest = [1e-4 * np.ones(4000), np.zeros(0)]
    bench.weigh([np.tile([1e-4, -1e-4], 2000), rest[1]])
    learnt, held = (s.sigma for s in bench.series)
    assert held == pytest.approx(learnt, rel=0.2)


def turning(order: float, size: float, hum: float = 0.0) -> Record:
    """A motor at 14 turns a second read at 250 Hz; its torque has a ripple, and a hum of 113 Hz."""
    rng, time = np.random.default_rng(7), np.arange(1800) / 250.0
    angle = 2.0 * np.pi * (14.0 * time - 2.0 * np.exp(-2.0 * time))
    torque = 0.3 + size * np.sin(order * angle + 1.0) + hum * np.sin(2.0 * np.pi * 113.0 * time)
    torque += 0.01 * rng.standard_normal(1800)
    return Record("joint", time, {"motor_angle": angle, "motor_torque": torque})


@pytest.mark.parametrize("order", [5.0, 6.0, 7.0, 8.0, 10.0])
def test_a_quick_ripple_of_the_motors_turn_is_no_noise(order):
    """Orders 5 to 8 are 70 to 112 Hz of 125; order 10 is read as 110 Hz."""
    record = turning(order, 0.2)
    as_noise = noise_floor(record.channels["motor_torque"], np.ones(1800, dtype=bool))
    _, _, noise, _ = Predictor(record, plan_for(record), 100.0).measured("motor_torque")
    assert as_noise > 0.03
    assert noise == pytest.approx(0.01, rel=0.1)


def test_what_is_no_order_of_the_turn_stays_noise():
    everything = np.ones(1800, dtype=bool)
    for record in (turning(5.0, 0.0), turning(5.0, 0.0, hum=0.05)):
        torque = record.channels["motor_torque"]
        angle = record.channels["motor_angle"]
        np.testing.assert_array_equal(without_orders(torque, everything, angle), torque)
        np.testing.assert_array_equal(without_orders(torque, everything, 0.01 * angle), torque)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(400, 3000), st.floats(0.3, 40.0))
def test_white_noise_has_no_order(seed, n, turns_a_second):
    noise = np.random.default_rng(seed).standard_normal(n)
    angle = 2.0 * np.pi * (3.0 + turns_a_second) * np.arange(n) / 250.0
    np.testing.assert_array_equal(without_orders(noise, np.ones(n, dtype=bool), angle), noise)


@pytest.mark.skipif(not JOINT.exists(), reason="the recording is not here")
def test_a_real_joint_with_two_encoders_is_compared_by_its_transmission_error():
    """NEURA LARA8, joint 3: each angle has 32 arcsec of noise from the clock, their difference 5.3."""
    log = np.genfromtxt(JOINT, delimiter=",", names=True)
    turn = 2.0 * np.pi / 2**24
    angles = {f"{side}_angle": log[f"encoder_{side[:5].replace('outpu', 'load')}inc_3"] * turn
              for side in ("motor", "output")}  # fmt: skip
    record = Record("joint 3", log["Timestamp"] - log["Timestamp"][0], angles)
    alone = noise_floor(angles["output_angle"], np.ones(len(log), dtype=bool))
    _, _, noise, _ = Predictor(record, plan_for(record), 101.0).measured("output_angle")
    arcsec = np.degrees(1.0) * 3600.0
    assert alone * arcsec == pytest.approx(32.0, rel=0.1)
    assert noise * arcsec < 5.5
