"""Means of successive readings in the place of readings: how far, with what noise, and what they keep."""

import sys
from pathlib import Path

import numpy as np
import pytest

from hdsim.estimate.noise import noise_of_means, quantisation_step
from hdsim.estimate.predict import Predictor, plan_for
from hdsim.estimate.records import Record
from hdsim.estimate.thin import Means, readings_of_means, thinned

RATE = 5000.0


def record(seconds=16.0, *, noise=2e-3, ripple=0.0, steps=0.0, seed=0):
    """A swing read at 5 kHz: torques follow the motion; a ripple of 400 Hz comes on top."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE)) / RATE
    angle = 60.0 * (1.0 - np.cos(2 * np.pi * 0.3 * time))
    torque = 0.05 * np.sin(2 * np.pi * 0.3 * time) + ripple * np.sin(2 * np.pi * 400.0 * time)
    torque = torque + noise * rng.standard_normal(len(time))
    if steps > 0:
        torque = np.round(torque / steps) * steps
    return Record(
        "swing", time, {"motor_angle": angle + 1e-5 * rng.standard_normal(len(time)), "motor_torque": torque}
    )


def test_white_noise_is_averaged_away_as_far_as_samples_are_left():
    assert readings_of_means([record()]) == 8  # 80,000 readings, 8000 wanted


def test_few_readings_stay_as_they_are():
    assert readings_of_means([record(3.0)]) == 1


def test_what_is_fast_is_not_averaged_away():
    # A ripple with half of the noise in power: of 4 readings means would take a sixth, of 8 nearly half.
    assert readings_of_means([record(ripple=2e-3)]) <= 2


@pytest.mark.parametrize(("left", "count"), [(1e-4, 2), (1e-3, 8)])
def test_what_is_fast_is_averaged_away_beside_far_more_that_a_model_leaves(left, count):
    # All of the ripple's 2e-6 may be lost beside 1e-3, of which a name must explain twice as much.
    assert readings_of_means([record(ripple=2e-3)], left={"motor_torque": left}) == count


def test_noise_that_is_not_white_is_not_averaged_away():
    one = record()
    slow = np.convolve(one.channels["motor_torque"], np.ones(5) / 5, mode="same")
    one.channels["motor_torque"] = slow + 1e-4 * np.random.default_rng(1).standard_normal(len(slow))
    assert readings_of_means([one]) == 1


@pytest.mark.parametrize("steps", [0.0, 4e-3])
def test_the_noise_of_means_is_what_they_scatter_by(steps):
    one = record(steps=steps)
    few = thinned(one, 8)
    true = 0.05 * np.sin(2 * np.pi * 0.3 * (few.time + few.begins_s))
    told = Predictor(few, plan_for(few), 100.0).measured("motor_torque")
    scatter = float(np.std(few.channels["motor_torque"] - true))
    assert told[2] == pytest.approx(scatter, rel=0.1)
    assert told[3] == pytest.approx(np.hypot(2e-3, steps / np.sqrt(12.0)), rel=0.1)


def test_steps_within_which_a_sensor_rests_are_not_averaged_away():
    angle = 0.3 * np.arange(4000) / 4000
    step = 0.02
    values = np.round(angle / step) * step  # 266 readings a step, no noise
    good = np.ones(len(values), dtype=bool)
    means = values.reshape(-1, 8).mean(axis=1)
    there = np.ones(len(means), dtype=bool)
    assert quantisation_step(values) == pytest.approx(step)
    found = noise_of_means(values, good, step, means, there, 8)
    true = np.std(means - angle.reshape(-1, 8).mean(axis=1))
    assert found == pytest.approx(true, rel=0.1)


def test_a_mean_counts_where_half_of_its_readings_do_and_none_spans_a_gap():
    one = record(2.0)
    one.trusted["motor_torque"][8:11] = False
    one.trusted["motor_torque"][16:21] = False
    one.time[84:] += 0.1
    few = thinned(one, 8)
    good = few.trusted["motor_torque"]
    assert good[[1, 2, 10]].tolist() == [True, False, False]
    assert good.sum() == len(good) - 2
    assert not few.trusted["motor_angle"][10]


@pytest.mark.slow
def test_means_keep_the_numbers_and_the_verdict(tmp_path):
    """The same swing of a rigid drive read eight times as fast: the same numbers, within their intervals."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "diagnose"))
    import diagnose_bench as bench

    from hdsim.diagnosis.workflow import diagnose

    kept, bench.RATE = bench.RATE, 4000.0
    try:
        fast = bench.rigid_record(coulomb=0.04, noise=4e-3)
    finally:
        bench.RATE = kept
    slow = Record("slow", fast.time[::8], {c: v[::8] for c, v in fast.channels.items()})
    scenario = bench.scenario(tmp_path)
    means, picked = diagnose([fast], scenario).verdict, diagnose([slow], scenario).verdict
    assert (means.readings, picked.readings) == (4, 1)
    assert means.verdict == picked.verdict == "parameter"
    assert means.gap["motor_torque"].noise == pytest.approx(2e-3, rel=0.1)
    number = means.parameters["drive.friction.coulomb_nm"]
    low, high = number.interval
    other = picked.parameters["drive.friction.coulomb_nm"].interval
    assert low < 0.04 < high
    assert other[0] < 0.04 < other[1]
    # The interval is mostly the torque's unknown gain, which no number of readings tells.
    value = picked.parameters["drive.friction.coulomb_nm"].value
    assert abs(number.value - value) < 0.05 * (high - low)


def test_means_of_a_course_are_what_readings_of_it_average_to():
    rng = np.random.default_rng(4)
    time = (np.arange(16000) + rng.uniform(-0.2, 0.2, 16000)) / RATE

    def ripple(at):
        return np.sin(2 * np.pi * 40.0 * at + 3.0 * np.sin(2 * np.pi * 0.5 * at))

    few = thinned(Record("ripple", time, {"motor_torque": ripple(time)}), 8)
    course, means, inside = ripple(few.time + few.begins_s), few.channels["motor_torque"], slice(1, -1)
    missed = (Means(few).of(course) - means)[inside]
    assert np.std(course - means) > 4e-3
    assert np.std(missed) < 0.05 * np.std(course - means)
    back = (Means(few).behind(means) - course)[inside]
    assert np.std(back) < 0.05 * np.std(course - means)


def test_readings_are_left_as_they_are():
    one = record(3.0)
    values = one.channels["motor_torque"]
    assert Means(one).of(values) is values
    assert Means(one).behind(values) is values
