"""A known error of the encoder whose reading is prescribed: against root finding and a run's truth."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PPoly
from scipy.optimize import brentq

import hdsim
from hdsim.effects.sensors import Encoder, EncoderRipple, Sensors
from hdsim.estimate.opening import bench_for
from hdsim.estimate.prescribed import LEAD_IN_S
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.estimate.true_motion import errors_of, true_motion
from hdsim.scenario import Scenario

ECCENTRIC = {"motor_angle": {"eccentricity_arcmin": 30.0, "eccentricity_phase_deg": 70.0}}


def scenario(effects: dict | None = None) -> Scenario:
    return Scenario.model_validate({
        "drive": {"preset": "seed-2021", "mesh": {"model": "lumped"}},
        "effects": effects or {},
        "command": {
            "motor": {
                "type": "motion",
                "trajectory": {"type": "sine", "amplitude_deg": 4000.0, "frequency_hz": 0.4},
            }
        },
        "load": {"inertia_kg_m2": 0.5},
        "run": {"duration_s": 5.0, "sample_rate_hz": 1000.0},
    })  # fmt: skip


@given(
    amplitude=st.floats(0.0, 0.15),
    phase=st.floats(-np.pi, np.pi),
    speed=st.floats(1.0, 300.0),
    order=st.integers(2, 8),
    ripple=st.floats(0, 0.01),
)
def test_the_true_angle_is_the_root_of_what_was_read(amplitude, phase, speed, order, ripple):
    time = np.linspace(0.0, 0.2, 21)
    reading = CubicSpline(time, speed * (time + 0.3 * np.sin(9.0 * time)))
    errors = ((1.0, amplitude, phase), (float(order), ripple, 0.5))
    breaks, found = true_motion(time, reading.c[::-1], errors)
    angle = PPoly(found[::-1], breaks)

    def read(theta):
        return theta + sum(a * np.sin(n * theta + p) for n, a, p in errors)

    # At the ends of every piece exactly, between them to the fourth power of what it turns.
    for t in (0.0, 0.07, 0.1, 0.2):
        want = brentq(lambda theta, t=t: read(theta) - reading(t), reading(t) - 0.3, reading(t) + 0.3)
        exact = np.min(np.abs(breaks - t)) < 1e-12
        assert angle(t) == pytest.approx(want, abs=1e-9 if exact else 1e-3 * (amplitude + ripple) + 1e-9)
    assert np.allclose(angle(breaks[1:-1] - 1e-12), angle(breaks[1:-1] + 1e-12), atol=1e-8 * speed)


def test_an_encoder_says_the_sines_of_its_own_scale_alone():
    encoder = Encoder(
        eccentricity_arcmin=6.0,
        eccentricity_phase_deg=30.0,
        ripple=(
            EncoderRipple(order=4, amplitude_arcsec=60.0, phase_deg=90.0),
            EncoderRipple(order=1, per="output_turn", amplitude_arcsec=60.0),
        ),
    )
    found = errors_of({"sensors": Sensors(motor_angle=encoder)}, "motor_angle")
    arcmin = np.pi / 180 / 60
    assert np.allclose(found, [(4.0, arcmin, np.pi / 2), (1.0, 6.0 * arcmin, -np.pi / 6)])
    assert errors_of({"sensors": Sensors(motor_angle=encoder)}, "output_angle") == ()
    assert errors_of({}, "motor_angle") == ()


def test_a_reading_that_may_stand_still_is_refused_with_the_field():
    time = np.linspace(0.0, 1.0, 11)
    line = np.array([10.0 * time[:-1], np.full(10, 10.0), np.zeros(10), np.zeros(10)])
    with pytest.raises(ValueError, match=r"at most 0\.5"):
        true_motion(time, line, ((64.0, 0.017, 0.0),))
    ripple = [{"order": 64, "amplitude_arcsec": 3600}]
    base = scenario({"sensors": {"motor_angle": {"ripple": ripple}}})
    run = hdsim.simulate(scenario())
    channels = {c: run[c] for c in ("motor_angle", "output_angle", "motor_torque")}
    with pytest.raises(ArithmeticError, match=r"sensors.motor_angle: the encoder's error"):
        bench_for([Record("r", run.time, channels)], [], base, None).predict(state_of(base))


def test_what_follows_from_the_true_motion_is_predicted_from_an_eccentric_reading():
    # Without the correction the torque is missed by J a w^2, 5e-5 * 8.7e-3 * 175^2 = 0.013 N m.
    run = hdsim.simulate(scenario({"sensors": ECCENTRIC}))
    channels = {
        "motor_angle": run["measured_motor_angle"],
        "output_angle": run["output_angle"],
        "motor_torque": run["motor_torque"],
    }
    missed = {}
    for name, effects in {"knows": {"sensors": ECCENTRIC}, "does not": {}}.items():
        bench = bench_for([Record("r", run.time, channels)], [], scenario(effects), None)
        (predictor,) = bench.predictors
        got = predictor.predict(state_of(scenario(effects)).candidate())
        missed[name] = {c: float(np.std((got[c] - channels[c])[100:-100])) for c in got}
    for channel in ("output_angle", "motor_torque"):
        assert missed["knows"][channel] < 0.05 * missed["does not"][channel]
    assert missed["does not"]["output_angle"] > 5e-5  # 30 arcmin over a ratio of 100, root mean square


@pytest.mark.slow
def test_an_eccentric_motor_encoder_is_named_and_found():
    rng = np.random.default_rng(4)
    run = hdsim.simulate(scenario({"sensors": ECCENTRIC}))
    noise = {"motor_angle": 2e-5, "output_angle": 5e-6, "motor_torque": 1e-3}
    read = {c: run["measured_motor_angle" if c == "motor_angle" else c] for c in noise}
    channels = {c: v + noise[c] * rng.standard_normal(len(v)) for c, v in read.items()}
    verdict = hdsim.diagnose([Record("r", run.time, channels)], scenario()).verdict
    assert verdict.verdict == "effect"
    (found,) = verdict.effects
    assert found.name == "sensors"
    amplitude = found.parameters["motor_angle.eccentricity_arcmin"]
    assert amplitude.interval[0] <= 30.0 <= amplitude.interval[1]
    assert amplitude.value == pytest.approx(30.0, rel=0.1)
    gap = verdict.gap["motor_torque"]
    assert gap.after < 0.2 * gap.refit


def test_the_outputs_own_reading_is_corrected_too_where_it_is_prescribed():
    sensors = {"sensors": {"output_angle": {"eccentricity_arcmin": 20.0, "eccentricity_phase_deg": 40.0}}}
    run = hdsim.simulate(scenario(sensors))
    channels = {"output_angle": run["measured_output_angle"], "motor_torque": run["motor_torque"]}
    (predictor,) = bench_for([Record("r", run.time, channels)], [], scenario(sensors), None).predictors
    motor = predictor._motion(state_of(scenario(sensors)).candidate()).values(run.time + LEAD_IN_S)[0]
    assert np.std(motor / predictor.ratio - run["output_angle"]) < 1e-9  # 2.1e-3 rad without
