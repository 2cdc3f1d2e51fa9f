from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hdsim.log import LogWriter, write_log
from hdsim.log.naming import EPOCH_NS
from hdsim.log.schemas import message_class
from hdsim.log.view import MinMaxView, corners
from hdsim.log.viewing import ARCSEC_PER_RAD, LOOP_EVERY, LOOP_POINTS, LOOP_SAMPLES
from hdsim.recording import Column, Recording, Table


def view_of(time, columns, rate, cuts=()):
    view = MinMaxView(rate)
    parts = [
        view.feed(time[a:b], [c[a:b] for c in columns])
        for a, b in zip([0, *cuts], [*cuts, len(time)], strict=True)
    ]
    last = view.finish()
    if last is not None:
        parts.append(last)
    return (
        np.concatenate([p[0] for p in parts]),
        [np.concatenate([p[1][i] for p in parts]) for i in range(len(columns))],
    )


values = st.one_of(st.floats(-10, 10), st.just(np.nan))


@given(st.integers(1, 200).flatmap(lambda n: hnp.arrays(np.float64, (n, 3), elements=values)), st.data())
@settings(deadline=None)
def test_no_extreme_is_lost_and_times_increase(table, data):
    n = len(table)
    time = np.cumsum(data.draw(hnp.arrays(np.float64, n, elements=st.floats(1e-3, 2.0)))) - 20.0
    rate = data.draw(st.floats(0.05, 10.0))
    cuts = sorted(data.draw(st.lists(st.integers(0, n), max_size=4)))
    thin_time, (thin,) = view_of(time, [table], rate, cuts)
    assert (np.diff(thin_time) > 0).all()
    assert np.isin(thin_time, time).all()
    slot, thin_slot = np.floor(time * rate / 2), np.floor(thin_time * rate / 2)
    for s in np.unique(slot):
        inside, kept = table[slot == s], thin[thin_slot == s]
        assert len(kept) == min(2, len(inside))
        if len(inside) <= 2:
            np.testing.assert_array_equal(kept, inside)
            continue
        for j in range(3):
            there = inside[~np.isnan(inside[:, j]), j]
            if len(there):
                assert sorted(kept[:, j]) == [there.min(), there.max()]
            else:
                assert np.isnan(kept[:, j]).all()
    whole_time, (whole,) = view_of(time, [table], rate)
    np.testing.assert_array_equal(thin_time, whole_time)
    np.testing.assert_array_equal(thin, whole)


def test_a_falling_slot_keeps_falling():
    time = np.arange(8.0)
    _, (thin,) = view_of(time, [np.array([0, 5, 2, 4, 9, 3, 8, 1.0])], 0.5)
    assert thin.tolist() == [0, 5, 9, 1]


def read_topic(path, topic):
    from mcap.reader import make_reader

    with open(path, "rb") as file:
        return [
            message_class(schema.name, schema.data).FromString(message.data)
            for schema, _, message in make_reader(file).iter_messages([topic])
        ]


@pytest.mark.parametrize(("n", "least", "most"), [(3_000, 3_000, 3_000), (100_000, 19_000, 20_002)])
def test_the_view_of_a_run_holds_at_most_20000_samples_and_its_peak(tmp_path, n, least, most):
    time = np.linspace(2.0, 12.0, n)
    angle = np.sin(time)
    angle[n // 3] = 1e6
    path = write_log(Recording({"state": Table(time, {"angle": Column(angle, "rad")})}), tmp_path / "a.mcap")
    messages = read_topic(path, "/hd/state_view")
    assert least <= len(messages) <= most
    assert max(m.angle for m in messages) == 1e6
    assert min(m.angle for m in messages) == angle.min()


def test_views_hold_small_angles_and_lengths_in_units_that_fill_an_axis(tmp_path):
    state = Table(
        np.arange(3.0),
        {
            "transmission_error": Column(np.array([1e-5, 2e-5, -1e-5]), "rad"),
            "motor_angle": Column(np.zeros(3), "rad"),
            "twist": Column(np.full(3, np.pi / 180 / 3600), "rad"),
        },
    )
    recording = Recording({"state": state}, static={"gap": Column(np.array([1e-6, 2e-6]), "m")})
    path = write_log(recording, tmp_path / "a.mcap")
    messages = read_topic(path, "/hd/state_view")
    np.testing.assert_allclose(
        [m.transmission_error_arcsec for m in messages], [2.062648, 4.125296, -2.062648], 1e-6
    )
    np.testing.assert_allclose([m.twist_arcsec for m in messages], 1.0)
    assert messages[1].transmission_error == 2e-5
    assert not hasattr(messages[0], "motor_angle_arcsec")
    (static,) = read_topic(path, "/hd/static_view")
    np.testing.assert_allclose(static.gap_um, [1.0, 2.0])


def loop_messages(path):
    """Log times in s and messages of the state's loop."""
    from mcap.reader import make_reader

    with open(path, "rb") as file:
        return [
            (1e-9 * (m.log_time - EPOCH_NS), message_class(schema.name, schema.data).FromString(m.data))
            for schema, _, m in make_reader(file).iter_messages(["/hd/state_loop"])
        ]


def twisted(n, rate=1000.0):
    time = np.arange(n) / rate
    phase = 2 * np.pi * time / max(time[-1], 1e-3)
    twist, torque = 1e-3 * np.sin(phase), 50 * np.sin(phase + 0.2)
    return Table(time, {"twist": Column(twist, "rad"), "output_torque": Column(torque, "N m")})


def test_the_first_loop_message_holds_a_curve_already(tmp_path):
    path = write_log(Recording({"state": twisted(5000)}), tmp_path / "a.mcap")
    at, first = loop_messages(path)[0]
    assert at == 0.0
    drawn = np.isfinite(first.twist_arcsec) & np.isfinite(first.output_torque)
    assert drawn.sum() >= 250
    assert np.ptp(np.array(first.output_torque)[drawn]) > 30
    assert np.ptp(np.array(first.twist_arcsec)[drawn]) > 100


@pytest.mark.parametrize("n", [1, 2, 99, 100, 101, 250, 500, 501, 1001, 1999, 2000, 2001, 2101, 5000])
def test_a_loop_holds_the_run_around_its_moment_and_marks_where_it_is(tmp_path, n):
    state = twisted(n)
    path = tmp_path / "a.mcap"
    with LogWriter(path, metadata={}, view_rate_hz=np.inf) as log:
        cuts = [0, *sorted(np.random.default_rng(n).integers(0, n, 3)), n]
        for a, b in pairwise(cuts):
            rows = {name: Column(c.values[a:b], c.unit) for name, c in state.columns.items()}
            log.write("state", Table(state.time[a:b], rows))
    torque = state.columns["output_torque"].values
    twist = state.columns["twist"].values * ARCSEC_PER_RAD
    place = {pair: k for k, pair in enumerate(zip(twist, torque, strict=True))}
    messages = loop_messages(path)
    assert len(messages) == -(-n // LOOP_EVERY)
    assert (np.diff([at for at, _ in messages]) > 0).all()
    for k, (at, message) in enumerate(messages):
        begin = k * LOOP_EVERY
        assert at == pytest.approx(state.time[begin], abs=1e-9)
        whole = np.array(message.output_torque)
        # One uninterrupted piece of the run, at its ends the first or the last samples.
        first = min(max(0, begin - LOOP_SAMPLES // 2), max(0, n - LOOP_SAMPLES))
        size = min(n, LOOP_SAMPLES)
        every = -(-size // LOOP_POINTS)
        points = whole[np.isfinite(whole)]
        assert np.isnan(whole[len(points) :]).all()
        # Of each group of samples one; all of them in a short run.
        pairs = zip(message.twist_arcsec, message.output_torque, strict=True)
        chosen = np.array([place[pair] for pair in pairs if np.isfinite(pair[1])])
        assert len(chosen) == len(points) == size // every + (n % every > 0 and n < LOOP_SAMPLES)
        groups = chosen // every
        assert (np.diff(groups) == 1).all()
        assert first <= chosen[0] < first + 2 * every - 1
        assert first + size - every <= chosen[-1] < first + size
        now = np.array(message.output_torque_now)
        marked = np.isfinite(now)
        np.testing.assert_array_equal(now[marked], whole[marked])
        inside = (chosen >= begin) & (chosen <= begin + LOOP_EVERY)
        np.testing.assert_array_equal(marked[: len(chosen)], inside)
        assert not marked[len(chosen) :].any()


def test_the_points_of_a_loop_keep_its_shape_and_its_corners():
    # A backlash loop: two straight branches, jumps through the gap, and one overshoot of a single sample.
    phase = np.linspace(0, 2 * np.pi, 2000)
    torque = 50 * np.sin(phase)
    twist = 100 * np.sin(phase) + np.where(np.cos(phase) > 0, 20.0, -20.0)
    torque[700] += 15
    chosen = corners(twist, torque, 4)
    assert (chosen // 4 == np.arange(500)).all()
    assert 700 in chosen
    assert torque[chosen].min() == pytest.approx(-50, abs=1e-3)
    # No sample lies farther from the thinned curve than two pixels of a panel of 400.
    x, y = twist / np.ptp(twist), torque / np.ptp(torque)
    a, b = np.stack([x, y])[:, chosen[:-1], None], np.stack([x, y])[:, chosen[1:], None]
    offset = np.stack([x, y])[:, None, chosen[0] : chosen[-1] + 1] - a
    share = np.clip((offset * (b - a)).sum(0) / ((b - a) ** 2).sum(0), 0, 1)
    distance = np.sqrt(((offset - share * (b - a)) ** 2).sum(0)).min(axis=0)
    assert distance.max() < 5e-3


def test_the_points_of_a_loop_may_be_missing_or_all_the_same():
    gap = np.full(8, np.nan)
    np.testing.assert_array_equal(corners(gap, gap, 4), [0, 4])
    np.testing.assert_array_equal(corners(np.zeros(9), np.zeros(9), 4), [0, 4, 8])
    half = np.array([0.0, 1.0, 9.0, 1.0, np.nan, np.nan, 5.0, np.nan])
    np.testing.assert_array_equal(corners(half, half, 4)[1:], [6])
    np.testing.assert_array_equal(corners(np.array([1.0]), np.array([2.0]), 1), [0])
    np.testing.assert_array_equal(corners(np.array([1.0, np.inf]), np.array([2.0, 1.0]), 2), [0])


def test_who_watches_a_run_sees_loops_of_what_there_is_and_the_log_of_what_comes(tmp_path):
    state = twisted(5000)
    told = []

    def watch(schema, channel, log_times, bodies):
        if channel.topic == "/hd/state_loop":
            of = message_class(schema.name, schema.data)
            told.extend((t, of.FromString(body)) for t, body in zip(log_times, bodies, strict=True))

    path = tmp_path / "a.mcap"
    with LogWriter(path, metadata={}, view_rate_hz=np.inf, watch=watch) as log:
        for begin in range(0, 5000, 50):
            rows = slice(begin, begin + 50)
            columns = {name: Column(c.values[rows], c.unit) for name, c in state.columns.items()}
            log.write("state", Table(state.time[rows], columns))
            # Whoever watches has heard of it as soon as it is computed, and of nothing later.
            upto = EPOCH_NS + round(1e9 * state.time[rows][-1])
            assert upto - 100_000_000 < told[-1][0] <= upto
    assert (np.diff([at for at, _ in told]) > 0).all()
    torque = state.columns["output_torque"].values
    for at, message in told:
        count = round(1e-9 * (at - EPOCH_NS) * 1000) + 1
        held = np.array(message.output_torque)
        held = held[np.isfinite(held)]
        recent = torque[max(0, count - LOOP_SAMPLES) : count]
        every = -(-len(recent) // LOOP_POINTS)
        assert len(recent) // every <= len(held) <= LOOP_POINTS
        assert np.isin(held, recent).all()
        assert np.isin(held[-1], recent[-every:])
        if every == 1:
            np.testing.assert_array_equal(held, recent)
    alone = write_log(Recording({"state": state}), tmp_path / "b.mcap")
    assert [m.SerializeToString() for _, m in loop_messages(path)] == [
        m.SerializeToString() for _, m in loop_messages(alone)
    ]
