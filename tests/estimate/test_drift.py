"""Zeros of torque sensors that drift from one record to the next bend no number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rig import NOISE, TRUTH, model, record

import hdsim
from hdsim.estimate.drift import drifted
from hdsim.estimate.offsets import drift_columns, offsets_of
from hdsim.estimate.records import Record

#: A standard deviation and a half of a reading's noise: nobody sees that in a record.
DRIFT_NM = 1.5 * NOISE["motor_torque"]


def _mirrored(one: Record) -> Record:
    """The same run the other way round: all of a drive is odd."""
    return Record(f"{one.name} back", one.time, {c: -v for c, v in one.channels.items()})


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """One way with its zero too high, the other way too low: weight and stiffness do as much."""
    records = [
        record(3, 4.0, torque_offset=DRIFT_NM),
        _mirrored(record(4, 4.0, torque_offset=DRIFT_NM)),
    ]
    scenario = model(tmp_path_factory.mktemp("drift"))
    return hdsim.fit(records, scenario, fix=["motor_torque_gain"]), scenario


def test_what_drifts_is_no_weight(fitted):
    found, _ = fitted
    for one in found.intervals:
        if one.name in TRUTH:
            assert one.low <= TRUTH[one.name] <= one.high, one.name
    mass = next(i for i in found.intervals if i.name == "load.gravity.mass_kg")
    assert mass.value == pytest.approx(TRUTH["load.gravity.mass_kg"], rel=2e-3)
    assert mass.high - mass.low < 0.004 * mass.value  # what is told from the drift is known as well as before


def test_a_fit_beside_drifting_zeros_stays_where_it_is(fitted):
    found, _ = fitted
    again = drifted(found.bench, found.fit)
    spread = np.sqrt(np.diag(found.fit.covariance))
    assert np.max(np.abs(again.theta - found.fit.theta) / spread[: len(again.theta)]) < 0.1


def test_one_record_has_nothing_to_drift_from(tmp_path):
    found = hdsim.fit([record(3, 3.0)], model(tmp_path), fix=["motor_torque_gain"])
    assert drifted(found.bench, found.fit) is found.fit


def test_a_drift_does_to_the_data_what_its_column_says(fitted):
    bench = fitted[0].bench
    columns, spreads = drift_columns(bench.series, bench.training, bench.zeros)
    torques = [k for k, one in enumerate(bench.series) if one.channel == "motor_torque"]
    assert columns.shape[1] == len(spreads) == len(torques) == 2
    assert spreads == pytest.approx(2.0 / np.sqrt(3.0) * NOISE["motor_torque"], rel=0.1)
    for column, k in enumerate(torques):
        values = [np.full(len(one.measured), float(j == k)) for j, one in enumerate(bench.series)]
        zeros = offsets_of(bench.series, values, bench.zeros, drift=False)
        there = bench.stacked([v - zero for v, zero in zip(values, zeros, strict=True)])
        assert columns[:, column] == pytest.approx(there, abs=1e-9)
    # A zero that is each record's own, or none, has nothing beside it.
    for zeros in ("record", "trusted"):
        assert drift_columns(bench.series, bench.training, zeros)[0].shape[1] == 0
    quiet = [replace(one, reading=0.0) for one in bench.series]
    assert drift_columns(quiet, bench.training, bench.zeros)[0].shape[1] == 0
    nowhere = [replace(one, train=np.zeros_like(one.train)) for one in bench.series]
    assert drift_columns(nowhere, bench.training, bench.zeros)[0].shape == (0, 0)
