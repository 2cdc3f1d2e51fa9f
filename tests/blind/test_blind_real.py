"""Effects that are put into recordings of real joints, against closed forms."""

from dataclasses import replace

import family_real as family
import numpy as np
import pytest
from contract import Measured
from real_records import (
    DATA,
    KINOVA,
    LARA,
    LARA_STOPS_S,
    Joint,
    lara,
    over_noise,
    rates,
    reading,
    remains,
    rings_at,
)
from scipy.ndimage import gaussian_filter1d

HERE = all((DATA / name).exists() for name in (KINOVA.format(1), KINOVA.format(2), LARA))
recordings = pytest.mark.skipif(not HERE, reason="the recordings are not here")


def joint(stiffness=2.0e4, inertia=5.0, hz=1000.0, speed=3.0):
    time = np.arange(0.0, 6.0, 1.0 / hz)
    channels = {"motor_angle": 100.0 * speed * time / 100.0, "output_angle": speed * time / 100.0,
                "motor_torque": np.zeros_like(time)}  # fmt: skip
    record = Measured("made", time, channels)
    return Joint("made 1", 100.0, "both", "", 0.05, stiffness, inertia, None, (record,)), record


def turned(angle):
    return 1e-4 * np.sin(2 * angle), 2e-4 * np.cos(2 * angle)


@pytest.mark.parametrize("speed", [3.0, 100.0])
def test_a_kinematic_error_moves_the_output_as_an_oscillator_answers_at_its_foot(speed):
    """Amplitude over that of the error: |k + i c w| / |k - J w^2 + i c w|; the motor carries J d'' / i."""
    made, record = joint(speed=speed)
    found = family.through(made, record, turned, np.zeros_like(record.time))
    k, inertia, w = made.stiffness, made.inertia, 2 * speed
    c = 2 * family.DAMPING * np.sqrt(k * inertia)
    answer = 1e-4 * abs(k + 1j * c * w) / abs(k - inertia * w**2 + 1j * c * w)
    late = record.time > 3.0
    assert np.ptp(found["output_angle"][late]) / 2 == pytest.approx(answer, rel=0.03)
    torque = inertia * w**2 * answer / made.ratio
    assert np.ptp(found["motor_torque"][late]) / 2 == pytest.approx(torque, rel=0.05)


def test_no_power_is_lost_in_a_kinematic_error():
    """Of a weight that hangs on the drive the motor lifts what the error lifts (virtual work)."""
    made, record = joint(inertia=0.1, speed=20.0)
    made = replace(made, weight=60.0)
    found = family.through(made, record, turned, np.zeros_like(record.time))
    late = record.time > 2.0
    motor, output = (record.channels[c][late] for c in ("motor_angle", "output_angle"))
    lifted = 60.0 * np.sin(output) * turned(motor)[1]
    assert np.std(found["motor_torque"][late] - lifted) < 0.03 * np.std(lifted)
    # Without it the motor would carry what the load's inertia asks for and nothing else.
    assert np.std(lifted) > 20 * 0.1 * 40.0**2 * 1e-4 / made.ratio


def test_a_slow_weight_twists_the_drive_and_loads_the_motor_as_statics_say():
    made, record = joint(speed=20.0)
    found = family.weight(made, record, 40.0, np.random.default_rng(3))
    late = record.time > 2.0
    twist = found["output_angle"][late]
    damped = 1e-3 * np.ptp(twist) * made.stiffness / made.ratio
    assert np.ptp(found["motor_torque"][late] + made.stiffness * twist / made.ratio) < damped
    angle = record.channels["output_angle"][late]
    columns = np.column_stack([np.cos(angle), np.sin(angle)])
    fitted = np.linalg.lstsq(columns, -made.stiffness * twist, rcond=None)[0]
    assert np.hypot(*fitted) == pytest.approx(40.0, rel=0.01)


def test_rates_of_a_made_signal():
    time = np.arange(0.0, 5.0, 1e-3)
    angle = np.sin(2 * time)
    speed, acceleration = rates(time, angle)
    inside = slice(200, -200)
    assert np.abs(speed - 2 * np.cos(2 * time))[inside].max() < 0.01
    assert np.abs(acceleration + 4 * np.sin(2 * time))[inside].max() < 0.02


@pytest.mark.parametrize("frequency", [11.0, 14.0, 25.0])
def test_a_joint_that_comes_to_rest_tells_the_frequency_at_which_it_rings(frequency):
    rng = np.random.default_rng(5)
    time = 7.0 + np.arange(0.0, 0.35, 0.004)
    rung = 5e-5 * np.exp(-3.0 * time) / np.exp(-21.0) * np.sin(2 * np.pi * frequency * time + 1.0)
    values = rung + 1e-4 * (7.35 - time) ** 2 - 2e-4 + rng.normal(0, 1e-5, len(time))
    assert rings_at(time, values) == pytest.approx(frequency, rel=0.02)


@recordings
def test_what_is_put_into_the_joint_with_both_encoders_yields_as_its_own_twist_does():
    """Two measures of J/K that share no sample: it rings at its stop; before, inertia twists it."""
    made = lara()
    record = made.records[0]
    output, motor = record.channels["output_angle"], record.channels["motor_angle"]
    rung = made.inertia / made.stiffness
    assert 1 / (2 * np.pi * np.sqrt(rung)) == pytest.approx(14.0, rel=0.03)
    _, acceleration = rates(record.time, output)
    turning = [output, 2 * output, 3 * output, *(order * motor for order in made.orders)]
    columns = [acceleration, np.ones_like(output), *(f(a) for a in turning for f in (np.sin, np.cos))]
    before = record.time < LARA_STOPS_S
    error = reading(made, record, "output_angle")[before]
    twisted = -np.linalg.lstsq(np.column_stack(columns)[before], error, rcond=None)[0][0]
    # The smooth twist of a stroke tells it to a factor of two: 20 Hz, and not 7.
    assert 0.45 * rung < twisted < 1.1 * rung


def test_strength_is_the_ratio_of_root_mean_squares_in_white_noise_and_by_frequency_in_any_other():
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 10.0, 1e-3)
    white = rng.normal(0, 3e-4, len(time))
    line = 1e-3 * np.sin(2 * np.pi * 80.0 * time)
    assert over_noise(time, line, white) == pytest.approx(1e-3 / np.sqrt(2) / 3e-4, rel=0.1)
    # A machine's own motion of ten times the size hides what is as slow as itself, and not what is not.
    slow = gaussian_filter1d(rng.normal(0, 6e-2, len(time)), 50)
    assert over_noise(time, line, white + slow) == pytest.approx(over_noise(time, line, white), rel=0.3)
    drift = 1e-3 * np.sin(2 * np.pi * 1.0 * time)
    assert over_noise(time, drift, white + slow) < 0.1 * over_noise(time, drift, white)


def test_what_is_known_of_a_joint_is_no_noise_and_what_it_does_beyond_that_is():
    made, record = joint(speed=20.0)
    rng = np.random.default_rng(2)
    motor, noise = record.channels["motor_angle"], rng.normal(0, 1e-3, len(record.time))
    own = 0.3 + 0.02 * np.sin(2.0 * motor + 1.0)
    for known, left in (((2.0,), noise), ((), noise + own - 0.3)):
        described = replace(made, orders=known)
        read = replace(record, channels=record.channels | {"motor_torque": own + noise})
        assert np.std(remains(described, read, "motor_torque")) == pytest.approx(np.std(left), rel=0.02)


@pytest.mark.slow
@recordings
def test_cases_are_the_recording_and_what_was_put_in():
    drawn = [family.draw(n, 1) for n in range(40)]
    assert [c.key for c in drawn] == [family.draw(n, 1).key for n in range(40)]
    assert {c.setup["joint"] for c in drawn} == {
        "kinova 1",
        "kinova 3",
        "kinova 4",
        "kinova 6",
        "kinova 7",
        "lara 3",
    }
    for case in drawn:
        assert case.without is not None
        for with_it, without in zip(case.records, case.without.records, strict=True):
            changed = {c for c, v in with_it.channels.items() if not np.array_equal(v, without.channels[c])}
            assert changed
            assert changed <= {"motor_torque", "output_angle", "output_torque"}
        if case.kind == "effect":
            assert family.LEAST <= case.strength[0] <= family.STRENGTH[1] * 1.001
    # The sensor carries what the weight adds: the difference of the torques, which is friction's, stays.
    carried = next(c for c in drawn if c.kind == "null")
    for with_it, without in zip(carried.records, carried.without.records, strict=True):
        rest = [r.channels["motor_torque"] * 100 - r.channels["output_torque"] for r in (with_it, without)]
        assert np.abs(rest[0] - rest[1]).max() < 1e-9


@recordings
def test_the_plain_model_of_the_joint_with_both_encoders_has_its_recorded_ratio_and_statics():
    known = lara()
    record = known.records[0]
    output = record.channels["output_angle"]
    speed, acceleration = rates(record.time, output)
    mass = float(known.base.split("mass_kg: ")[1].split(",")[0])
    weight = mass * 9.80665 * 0.4 * np.sin(output - known.hanging)
    torque = known.ratio * record.channels["motor_torque"]
    rest = torque - weight - known.inertia * acceleration
    friction = np.column_stack([np.ones_like(speed), np.tanh(speed * known.ratio / 0.5), speed])
    rest -= friction @ np.linalg.lstsq(friction, rest, rcond=None)[0]
    assert np.std(rest) < 0.05 * np.std(torque)
