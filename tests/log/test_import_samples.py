"""Clocks, counters, gaps and rows of a measured recording."""

import json

import numpy as np
import pytest
from foreign import ANGLE, BASE, TIME, N, simple, write_csv

from hdsim.errors import InputError
from hdsim.log.importing import import_recording


def test_a_coarse_clock_is_spread_over_the_samples(tmp_path):
    true = np.arange(100) * 0.002
    found = simple(
        tmp_path, np.floor(true / 0.016) * 0.016, true, BASE.replace("unit: s", "unit: s, quantised: true")
    )
    np.testing.assert_allclose(found.time, true, atol=1e-3)
    assert (np.diff(found.time) > 0).all()


def test_a_constant_rate_is_seen_through_a_coarse_clock_and_a_gap(tmp_path):
    # Ticks of two and a half samples: stamps come three times and twice in turn.
    true = np.arange(900) * 0.002
    true[500:] += 0.0731
    mapping = BASE.replace("unit: s", "unit: s, quantised: true")
    found = simple(tmp_path, np.floor(true / 0.005) * 0.005, true, mapping)
    for part in (slice(0, 500), slice(500, 900)):
        # The rate to a part in ten thousand, the beginning to half a tick.
        np.testing.assert_allclose(np.diff(found.time[part]), 0.002, rtol=1e-4)
        np.testing.assert_allclose(found.time[part], true[part], atol=0.0025)


@pytest.mark.parametrize("pause", [False, True])
@pytest.mark.parametrize("missing", [[], [700, 1500, 1501, 3400]])
def test_a_clock_as_quick_as_the_samples_shows_some_of_them_twice(tmp_path, missing, pause):
    # Stamps in whole milliseconds, each sample a hair before or after one: 20, 20, 22, 23, 23, 25 ms ...
    whole = np.arange(2, 4002)
    early = np.random.default_rng(4).random(len(whole)) < 0.4
    true, stamps = (np.delete(values, missing) for values in (whole * 1e-3, (whole - early) * 1e-3))
    if pause:
        true[2500:], stamps[2500:] = true[2500:] + 0.7, stamps[2500:] + 0.7
    mapping = BASE.replace("unit: s", "unit: s, quantised: true")
    found = simple(tmp_path, stamps, true, mapping)
    apart = found.time - true
    late = np.abs(apart - np.median(apart)) > 1e-5
    # Only of a few samples beside a missing one is it unknown which it was.
    assert late.sum() <= 8 * len(missing)
    assert np.abs(apart - np.median(apart)).max() < 1.1e-3
    assert (np.abs(np.diff(found.time) / np.diff(true) - 1) > 0.1).sum() <= 2 * len(missing)


def test_a_rate_that_changes_is_not_taken_for_a_constant_one(tmp_path):
    true = np.cumsum(np.where(np.arange(600) < 300, 0.002, 0.003))
    mapping = BASE.replace("unit: s", "unit: s, quantised: true")
    found = simple(tmp_path, np.floor(true / 0.016) * 0.016, true, mapping)
    np.testing.assert_allclose(found.time, true, atol=0.016)


def test_a_counter_that_wraps_goes_on(tmp_path):
    found = simple(
        tmp_path,
        np.arange(1000) * 5 % 256,
        np.zeros(1000),
        BASE.replace("unit: s", "unit: ms, wraps_at: 256"),
    )
    np.testing.assert_allclose(found.time, np.arange(1000) * 5e-3)


def test_an_angle_that_wraps_goes_on_and_a_rate_stands_for_time(tmp_path):
    turns = np.linspace(0, 40, 1000)
    found = simple(
        tmp_path,
        turns,
        turns % (2 * np.pi),
        "channels:\n  output_angle: {column: a, unit: rad, unwrap: true}\ntime: {rate_hz: 250}\n",
    )
    np.testing.assert_allclose(found["output_angle"], turns, atol=1e-12)
    np.testing.assert_allclose(found.time, np.arange(1000) / 250)


def test_gaps_are_told_and_masks_become_nan(tmp_path):
    rng = np.random.default_rng(0)
    time = np.concatenate([np.arange(500), np.arange(700, 1000)]) * 1e-3
    clean = np.sin(20 * time) + 1e-3 * rng.standard_normal(len(time))
    dirty = clean.copy()
    spikes = [50, 250, 600]
    dirty[spikes] += 0.1
    found = simple(
        tmp_path,
        time,
        dirty,
        BASE + "longest_gap_s: 0.01\nmasks:\n  - {type: interval, start_s: 0.1, end_s: 0.1995}\n"
        "  - {type: outliers, channels: [output_angle]}\n",
    )
    gone = np.flatnonzero(np.isnan(found["output_angle"]))
    assert set(range(100, 200)) | set(spikes) <= set(gone.tolist())
    assert len(gone) < 115
    np.testing.assert_allclose(json.loads(found.metadata["gaps"]), [[0.499, 0.7]])
    assert any(e.message == "gap of 0.201 s" and e.time == 0.499 for e in found.events)


def test_rows_are_selected_by_a_column(tmp_path):
    write_csv(tmp_path / "a.csv", {"t": TIME, "a": ANGLE, "fault": (np.arange(N) < 100) * 3.0})
    (tmp_path / "m.yaml").write_text(BASE + "select:\n  - {column: fault, at_most: 0}\n")
    found = import_recording(tmp_path / "a.csv", tmp_path / "m.yaml")
    np.testing.assert_array_equal(found["output_angle"], ANGLE[100:])
    assert found.time[0] == 0
    (tmp_path / "m.yaml").write_text(BASE + "select:\n  - {column: fault, at_least: 7}\n")
    with pytest.raises(InputError, match="no row meets"):
        import_recording(tmp_path / "a.csv", tmp_path / "m.yaml")
