"""A log that reads a sensor on a clock of its own: its repeated rows, and when its readings were taken."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from hdsim.estimate.check import check_record
from hdsim.estimate.clock import own_clock, taut_string
from hdsim.estimate.records import Record
from hdsim.estimate.spline import spline_through

#: Of the log, s, and of the sensor: it is 0.55 % slower.
LOG_S, SENSOR_S = 1e-3, 1.0055e-3
SECONDS = 6.0


def motion(time):
    """Angle of an output, rad."""
    return 1.2 * np.sin(2 * np.pi * 0.3 * time) + 0.1 * np.sin(2 * np.pi * 1.7 * time)


def logged(pauses=()):
    """What a log holds of a sensor's readings: each row the newest; when each was taken; which are repeated.

    Args:
        pauses: rows before which the logger paused for a reading.
    """
    rng = np.random.default_rng(0)
    written = LOG_S * np.arange(int(SECONDS / LOG_S))
    for row in pauses:
        written[row:] += SENSOR_S
    taken = SENSOR_S * np.arange(int(SECONDS / SENSOR_S) + 5)
    newest = np.searchsorted(taken, written, side="right") - 1
    repeated = np.diff(newest, prepend=-1) == 0
    angle = motion(taken) + 2e-6 * rng.standard_normal(len(taken))
    torque = 5.0 * np.sin(motion(taken)) + 0.02 * rng.standard_normal(len(taken))
    channels = {"output_angle": angle[newest], "motor_torque": torque[newest]}
    # Its stamps are those of a steady clock, whatever it did.
    return Record("log", LOG_S * np.arange(len(written)), channels), taken[newest], repeated


def test_readings_get_the_times_at_which_they_were_taken():
    record, taken, repeated = logged()
    clock = own_clock(record)
    assert repeated.sum() > 20
    np.testing.assert_array_equal(clock.repeated, repeated)
    apart = clock.time - taken[~repeated]
    assert np.ptp((record.time - taken)[~repeated]) > 0.95 * LOG_S
    assert np.ptp(apart) < 0.25 * LOG_S
    assert np.all(np.diff(clock.time) > 0)


def test_a_motion_on_the_sensors_clock_has_no_jerk_where_a_row_repeats():
    record, _, _ = logged()
    errors = []
    for own in (False, True):
        time, rows = record.time, np.ones(len(record.time), dtype=bool)
        if own:
            clock = own_clock(record)
            rows = ~clock.repeated
            time = clock.time
        spline, _ = spline_through(time, record.channels["output_angle"][rows], motion=True)
        inner = np.linspace(0.5, SECONDS - 0.5, 2000)
        step = 1e-3
        truth = (motion(inner + step) - 2 * motion(inner) + motion(inner - step)) / step**2
        errors.append(np.std(spline(inner, nu=2) - truth))
    assert errors[1] < 0.1 * errors[0]


def test_the_check_says_so_and_trusts_no_reading_twice():
    record, _, repeated = logged()
    before = record.time.copy()
    [found] = [p for p in check_record(record, 100.0).problems if p.kind == "clock"]
    assert found.channel == "time"
    assert found.count == repeated.sum()
    assert "clocks of their own" in found.message
    assert len(record.time) == len(record.channels["motor_torque"]) == len(before) - repeated.sum()
    assert not np.array_equal(record.time, before[~repeated])
    near = np.diff(np.flatnonzero(~record.trusted["motor_torque"]))
    assert 10 * repeated.sum() < len(near) < 21 * repeated.sum()


def test_a_reading_that_was_lost_is_counted():
    pauses = [1501, 3402]
    record, taken, repeated = logged(pauses)
    clock = own_clock(record)
    np.testing.assert_array_equal(clock.repeated, repeated)
    assert clock.lost == len(pauses)
    apart = clock.time - taken[~repeated]
    # The stamps know nothing of either pause, the readings' numbers do.
    assert np.ptp((record.time - taken)[~repeated]) > 2.9 * LOG_S
    assert np.ptp(apart) < 2.1 * LOG_S
    for first, last in zip([0, *pauses], [*pauses, len(taken)], strict=True):
        row = np.flatnonzero(~repeated)
        assert np.ptp(apart[(row >= first + 400) & (row < last - 400)]) < 0.8 * LOG_S


def test_a_row_that_is_missing_is_no_reading_more_than_its_stamp_says():
    # Rows that a bus has dropped, and rows that repeat the one before; sensor and log have one clock.
    rng = np.random.default_rng(2)
    time = LOG_S * np.arange(6000)
    angle = motion(time) + 2e-6 * rng.standard_normal(len(time))
    torque = 5.0 * np.sin(motion(time)) + 0.02 * rng.standard_normal(len(time))
    stale, gone = [900, 2650, 4210], [1400, 3301, 3302, 5200]
    for row in stale:
        angle[row], torque[row] = angle[row - 1], torque[row - 1]
    kept = np.delete(np.arange(len(time)), gone)
    record = Record("log", time[kept], {"output_angle": angle[kept], "motor_torque": torque[kept]})
    clock = own_clock(record)
    assert clock.repeated.sum() == clock.lost == len(stale)
    np.testing.assert_allclose(clock.time, time[kept][~clock.repeated], atol=1e-9)


@pytest.mark.parametrize("kind", ["noise", "rest", "one channel at rest"])
def test_what_repeats_by_itself_is_no_clock(kind):
    time = LOG_S * np.arange(3000)
    rng = np.random.default_rng(3)
    angle = np.where(time < 1.0, motion(time), motion(1.0))
    torque = np.where(time < 1.0, np.cos(time), np.cos(1.0))
    if kind == "noise":
        angle, torque = motion(time), rng.standard_normal(len(time))
    channels = {"output_angle": angle, "motor_torque": torque}
    if kind == "one channel at rest":
        channels = {"output_angle": np.round(angle / 1e-2) * 1e-2}
    record = Record("log", time, channels)
    assert own_clock(record) is None


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(0.2, 2.0), st.floats(-1.0, 1.0), st.floats(0.1, 1.0)), min_size=3, max_size=7
    )
)
def test_no_path_between_two_others_is_shorter_than_a_taut_string(points):
    steps, middles, widths = map(np.array, zip(*points, strict=True))
    x, low, high = np.cumsum(steps), middles - widths, middles + widths
    path = taut_string(x, low, high)
    assert np.all(path >= low - 1e-9)
    assert np.all(path <= high + 1e-9)

    def length(inner):
        y = np.concatenate([[middles[0]], inner, [middles[-1]]])
        return float(np.sum(np.hypot(np.diff(x), np.diff(y))))

    bounds = list(zip(low[1:-1], high[1:-1], strict=True))
    other = minimize(length, middles[1:-1], bounds=bounds, method="L-BFGS-B")
    assert length(path[1:-1]) <= other.fun + 1e-6
    assert path[[0, -1]] == pytest.approx(middles[[0, -1]])


@pytest.mark.parametrize("times", [2, 4])
def test_a_log_that_holds_each_reading_for_some_rows_is_the_log_of_its_readings(times):
    rng = np.random.default_rng(5)
    time = 4e-3 * np.arange(1500)
    read = {
        "output_angle": motion(time) + 1e-6 * rng.standard_normal(len(time)),
        "motor_torque": np.cos(time) + 0.01 * rng.standard_normal(len(time)),
    }
    held = {channel: np.repeat(values, times) for channel, values in read.items()}
    record = Record("held", 4e-3 / times * np.arange(times * len(time)), held)
    check_record(record, 100.0)
    np.testing.assert_allclose(record.time, time, atol=1e-9)
    for channel, values in read.items():
        np.testing.assert_array_equal(record.channels[channel], values)
        assert record.trusted[channel].all()


def test_coarse_steps_that_stand_together_where_little_moves_are_no_clock():
    """Everything repeats near a reversal, at one instant in ten; nothing does on the way."""
    time = LOG_S * np.arange(6000)
    rng = np.random.default_rng(6)
    angle = np.round((motion(time) + 1e-6 * rng.standard_normal(len(time))) / 1e-4) * 1e-4
    torque = np.round((5.0 * np.sin(motion(time)) + 0.001 * rng.standard_normal(len(time))) / 4e-3) * 4e-3
    record = Record("coarse", time, {"output_angle": angle, "motor_torque": torque})
    assert np.sum((np.diff(angle) == 0) & (np.diff(torque) == 0)) > 20
    assert own_clock(record) is None
