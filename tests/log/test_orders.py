from __future__ import annotations

import math

import numpy as np
import pytest

from hdsim.log import LogWriter
from hdsim.log.orders import OrderCollector
from hdsim.log.schemas import message_class
from hdsim.recording import Column, Table

ARCSEC = math.pi / 180 / 3600


def steady(turns=50.0, rpm=600.0, rate=2000.0, wobble=0.0):
    """A run at one speed with errors of 12, 5 and 2 arcsec at orders 0.02, 2 and 4.04."""
    time = np.arange(0, turns * 60 / rpm, 1 / rate)
    motor = -2 * math.pi * rpm / 60 * (time + wobble * np.sin(2 * time))
    error = ARCSEC * (12 * np.sin(0.02 * motor) + 5 * np.cos(2 * motor + 1) + 2 * np.sin(4.04 * motor))
    return {"motor_angle": motor, "output_angle": -motor / 100 + error, "transmission_error": error}, time


def spectrum_of(columns, time, size=10**9):
    collector = OrderCollector()
    for begin in range(0, len(time), size):
        rows = slice(begin, begin + size)
        collector.feed("state", time[rows], {name: values[rows] for name, values in columns.items()})
    return collector.spectrum()


@pytest.mark.parametrize("size", [7, 1000, 10**9])
def test_orders_have_their_amplitudes_however_the_run_is_cut(size):
    columns, time = steady()
    found = spectrum_of(columns, time, size)
    for order, arcsec in ((0.02, 12), (2, 5), (4.04, 2)):
        near = np.abs(found.order - order) < 0.05
        assert found.amplitude[near].max() == pytest.approx(arcsec, rel=0.05)
        assert found.order[near][np.argmax(found.amplitude[near])] == pytest.approx(order, abs=0.011)
    quiet = (found.order > 0.2) & (np.abs(found.order - 2) > 0.2) & (np.abs(found.order - 4.04) > 0.2)
    assert found.amplitude[quiet].max() < 0.05
    # The error over the angle is the run's own samples.
    exact = np.interp(found.output_angle, np.degrees(columns["output_angle"]), columns["transmission_error"])
    np.testing.assert_allclose(found.error * ARCSEC, exact, atol=1e-3 * ARCSEC)
    assert len(found.error) <= 2000
    assert len(found.order) <= 2000


@pytest.mark.parametrize(
    "changes",
    [{"turns": 3.0}, {"wobble": 0.2}, {"rate": 60.0}],
    ids=["too short", "no single speed", "too few samples"],
)
def test_other_runs_have_no_spectrum(changes):
    assert spectrum_of(*steady(**changes)) is None


def test_a_motor_that_swings_or_a_channel_that_lacks_gives_none():
    columns, time = steady()
    swing = columns | {"motor_angle": 300 * np.sin(time)}
    assert spectrum_of(swing, time) is None
    del columns["transmission_error"]
    assert spectrum_of(columns, time) is None


def test_the_log_holds_them_from_its_first_instant(tmp_path):
    from mcap.reader import make_reader

    columns, time = steady()
    with LogWriter(tmp_path / "a.mcap", metadata={}) as log:
        log.write("state", Table(time, {name: Column(values, "rad") for name, values in columns.items()}))
    with open(tmp_path / "a.mcap", "rb") as file:
        found = {
            c.topic: (m.log_time, message_class(s.name, s.data).FromString(m.data))
            for s, c, m in make_reader(file).iter_messages(["/hd/orders", "/hd/over_angle"])
        }
        file.seek(0)
        first = min(m.log_time for _, _, m in make_reader(file).iter_messages(["/hd/state"]))
    for topic, x in (("/hd/orders", "order"), ("/hd/over_angle", "output_angle_deg")):
        at, message = found[topic]
        assert at == first
        assert len(getattr(message, x)) == len(message.transmission_error_arcsec) > 100
