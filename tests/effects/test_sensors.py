"""Sensors against what their words say: counts, delays, statistics of the noise, reproducibility."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError

from hdsim.effects.sensors import Encoder, EncoderRipple, SensorRipple, Sensors, TorqueSensor, VelocitySensor
from hdsim.errors import InputError
from hdsim.testing.alone import Collector

TIMES = np.linspace(0.0, 2.0, 20001)
RAMP = 30.0 * TIMES


def test_contribute_registers_only_the_named_channels() -> None:
    build = Collector()
    Sensors(motor_angle=Encoder(), output_torque=TorqueSensor()).contribute(build)
    assert set(build.sensors) == {"motor_angle", "output_torque"}


def test_ideal_sensors_read_the_truth() -> None:
    wave = np.sin(40 * TIMES)
    sensors = Sensors(
        motor_angle=Encoder(),
        output_torque=TorqueSensor(),
        motor_velocity=VelocitySensor(method="tachometer"),
    ).readers(seed=0)
    for sensor in sensors.values():
        assert np.array_equal(sensor.read(TIMES, wave, TIMES, {}), wave)


def test_encoder_reads_whole_counts_within_half_a_count() -> None:
    reader = Sensors(output_angle=Encoder(counts_per_turn=4096)).readers(0)["output_angle"]
    step = 2 * math.pi / 4096
    reading = reader.read(TIMES, RAMP, TIMES, {})
    assert np.abs(reading - RAMP).max() <= step / 2 * (1 + 1e-9)
    assert np.allclose(reading / step, np.round(reading / step), atol=1e-6)
    assert np.std(reading - RAMP) == pytest.approx(step / math.sqrt(12), rel=0.02)  # uniform error


def test_two_opposed_heads_cancel_the_eccentricity() -> None:
    def error(phase: float) -> np.ndarray:
        encoder = Encoder(eccentricity_arcmin=2, eccentricity_phase_deg=phase)
        return Sensors(motor_angle=encoder).readers(0)["motor_angle"].read(TIMES, RAMP, TIMES, {}) - RAMP

    assert np.abs(error(20)).max() == pytest.approx(2 * math.radians(1 / 60), rel=1e-4)
    assert np.abs(error(20) + error(200)).max() < 1e-12


def test_delay_lags_a_ramp_by_speed_times_delay() -> None:
    reader = Sensors(motor_angle=Encoder(delay_s=3e-3)).readers(0)["motor_angle"]
    at = np.array([0.5, 1.00013, 1.7])
    assert np.allclose(reader.read(TIMES, RAMP, at, {}), 30.0 * (at - 3e-3), atol=1e-12)
    assert reader.history == 3e-3


def test_noise_is_white_gaussian_and_the_same_however_it_is_read() -> None:
    torque = TorqueSensor(noise_nm=0.2)
    reader = Sensors(output_torque=torque).readers(seed=5)["output_torque"]
    zero = np.zeros_like(TIMES)
    noise = reader.read(TIMES, zero, TIMES, {})
    assert np.mean(noise) == pytest.approx(0, abs=4 * 0.2 / math.sqrt(len(TIMES)))
    assert np.std(noise) == pytest.approx(0.2, rel=0.02)
    assert np.mean((noise / 0.2) ** 4) == pytest.approx(3, rel=0.06)
    lagged = [np.corrcoef(noise[:-lag], noise[lag:])[0, 1] for lag in (1, 2, 7, 100)]
    assert np.abs(lagged).max() < 4 / math.sqrt(len(TIMES))

    one_by_one = [reader.read(TIMES, zero, np.array([t]), {})[0] for t in TIMES[100:130]]
    assert np.array_equal(one_by_one, noise[100:130])
    again = Sensors(output_torque=torque, motor_torque=torque).readers(seed=5)
    assert np.array_equal(again["output_torque"].read(TIMES, zero, TIMES, {}), noise)
    for other in (again["motor_torque"], Sensors(output_torque=torque).readers(6)["output_torque"]):
        assert abs(np.corrcoef(other.read(TIMES, zero, TIMES, {}), noise)[0, 1]) < 4 / math.sqrt(len(TIMES))


def test_differenced_speed_has_the_step_of_one_count_per_window() -> None:
    sensors = Sensors(
        motor_angle=Encoder(counts_per_turn=10000), motor_velocity=VelocitySensor(window_s=1e-3)
    )
    reader = sensors.readers(0)["motor_velocity"]
    assert reader.needs == ("motor_angle",)
    reading = reader.read(TIMES, np.full_like(TIMES, 99.0), TIMES[100:], {"motor_angle": RAMP})
    step = 2 * math.pi / 10000 / 1e-3
    assert np.allclose(reading / step, np.round(reading / step), atol=1e-5)
    assert np.mean(reading) == pytest.approx(30.0, rel=1e-3)
    assert np.abs(reading - 30.0).max() < step
    with pytest.raises(InputError, match="motor_angle"):
        reader.read(TIMES, RAMP, TIMES, {})


def test_differenced_speed_sees_the_angle_sensors_own_readings() -> None:
    readers = Sensors(
        motor_angle=Encoder(noise_arcsec=5, delay_s=1e-3), motor_velocity=VelocitySensor(window_s=2e-3)
    ).readers(3)
    at = TIMES[200:260]
    context = {"motor_angle": RAMP}
    angle = readers["motor_angle"]
    expected = (angle.read(TIMES, RAMP, at, {}) - angle.read(TIMES, RAMP, at - 2e-3, {})) / 2e-3
    assert np.array_equal(readers["motor_velocity"].read(TIMES, RAMP, at, context), expected)
    assert readers["motor_velocity"].history == pytest.approx(3e-3)


def test_torque_sensor_ripple_gain_and_offset() -> None:
    ripple = (
        SensorRipple(order=4, relative_amplitude=0.02, phase_deg=90),
        SensorRipple(order=1, per="output_turn", amplitude_nm=0.3),
    )
    reader = Sensors(output_torque=TorqueSensor(gain_error=0.01, offset_nm=-0.2, ripple=ripple)).readers(0)
    sensor = reader["output_torque"]
    assert set(sensor.needs) == {"motor_angle", "output_angle"}
    torque = np.full_like(TIMES, 20.0)
    reading = sensor.read(TIMES, torque, TIMES, {"motor_angle": RAMP, "output_angle": RAMP / -100})
    expected = 20.0 * 1.01 - 0.2 + 0.4 * np.cos(4 * RAMP) + 0.3 * np.sin(RAMP / -100)
    assert np.allclose(reading, expected, atol=1e-9)


def test_resolution_rounds_the_torque() -> None:
    sensor = Sensors(motor_torque=TorqueSensor(resolution_nm=0.25)).readers(0)["motor_torque"]
    values = np.array([0.1, 0.13, -0.4, 1.0])
    times = np.arange(4.0)
    assert np.array_equal(sensor.read(times, values, times, {}), [0.0, 0.25, -0.5, 1.0])


def test_a_differenced_speed_refuses_a_tachometers_settings() -> None:
    with pytest.raises(ValidationError, match="tachometer"):
        VelocitySensor(noise_rad_per_s=0.1)


def test_an_encoders_ripple_counts_the_turns_of_the_shaft_that_it_names() -> None:
    ripple = (
        EncoderRipple(order=2, per="wave_generator_turn", amplitude_arcsec=3.0, phase_deg=40),
        EncoderRipple(order=3, per="output_turn", amplitude_arcsec=5.0),
    )
    sensors = Sensors(
        output_angle=Encoder(ripple=ripple),
        output_velocity=VelocitySensor(window_s=1e-3),
    ).readers(0)
    reader = sensors["output_angle"]
    assert set(reader.needs) == {"motor_angle", "output_angle"}
    context = {"motor_angle": 100 * RAMP, "output_angle": RAMP}
    arcsec = math.radians(1 / 3600)
    expected = 3 * arcsec * np.sin(200 * RAMP + math.radians(40)) + 5 * arcsec * np.sin(3 * RAMP)
    assert np.allclose(reader.read(TIMES, RAMP, TIMES, context) - RAMP, expected, atol=1e-3 * arcsec)
    # The speed is the difference of the same readings, so it needs the same channels.
    assert set(sensors["output_velocity"].needs) == {"motor_angle", "output_angle"}
