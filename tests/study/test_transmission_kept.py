"""A transmission error is taken once of the same samples, and anew of others."""

import numpy as np
import pytest

from hdsim.recording import Column, Recording, Table
from hdsim.studies.metrics.transmission import transmission_error

RATIO, AMPLITUDE = 50.0, 1e-4


def output(motor, amplitude):
    return motor / RATIO + amplitude * np.sin(2.0 * motor)


def test_an_error_is_taken_anew_where_the_samples_are_others():
    time = np.linspace(0.0, 1.0, 20001)
    motor = 1.2 * 2.0 * np.pi * RATIO * time
    columns = {
        "motor_angle": Column(motor, "rad"),
        "motor_velocity": Column(np.full_like(motor, motor[-1]), "rad/s"),
        "output_angle": Column(output(motor, AMPLITUDE), "rad"),
    }
    recording = Recording({"state": Table(time, columns)})
    first = transmission_error(recording, RATIO, 1)
    assert first.peak_to_peak == pytest.approx(2.0 * AMPLITUDE, rel=1e-3)
    assert transmission_error(recording, RATIO, 1) is first
    columns["output_angle"] = Column(output(motor, 3.0 * AMPLITUDE), "rad")
    assert transmission_error(recording, RATIO, 1).peak_to_peak == pytest.approx(6.0 * AMPLITUDE, rel=1e-3)
