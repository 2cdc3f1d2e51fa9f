"""Friction of a drive that sticks: known as far as the speed is, and not at rest."""

from __future__ import annotations

from types import SimpleNamespace

import moves
import numpy as np
import pytest
from noisy import noisy

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit
from hdsim.estimate.standstill import hear_standstill, leave_out_rest, resolution, standing
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

NOISE = {"motor_angle": 8e-6, "motor_torque": 4e-3}
BASE = """
name: a chirp that begins slowly
drive: {preset: csg-25-50, mesh: {model: lumped}}
command:
  motor:
    type: position
    at: output
    trajectory: {type: chirp, amplitude_deg: 4.4, start_frequency_hz: 0.03, end_frequency_hz: 1.4,
                 duration_s: 12}
    controller: {type: cascade, position_gain_per_s: 30, velocity_gain_nm_s_per_rad: 0.044,
                 velocity_integral_gain_nm_per_rad: 0.9}
load: {inertia_kg_m2: 0.875, gravity: {mass_kg: 7.0, centre_of_mass_m: 0.3}}
run: {duration_s: 12, sample_rate_hz: 500}
"""


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    path = tmp_path_factory.mktemp("sticks") / "base.yaml"
    path.write_text(BASE, encoding="utf-8")
    return hdsim.load_scenario(path)


def recorded(scenario):
    return noisy(hdsim.simulate(scenario), NOISE, seed=2)


@pytest.fixture(scope="module")
def record(base):
    return recorded(base)


def fitted(record, base):
    """The compared series after a re-fit and what it leaves of it."""
    bench = bench_for([record], [], base)
    found = refit(bench, state_of(base))
    (series,), (rest,) = bench.series, bench.residuals(found.fit.predictions)
    return bench, series, rest


@pytest.mark.slow
def test_a_sticking_drive_is_predicted_to_its_noise_while_it_turns(base, record):
    bench, series, rest = fitted(record, base)
    counted = series.train | series.hold
    assert bench.predictors[0].smoothing < 0.1
    assert counted.mean() > 0.8
    assert np.std(rest[counted]) < 1.1 * series.noise
    assert np.std(rest) > 2.0 * series.noise  # at rest the torque is what holds it


@pytest.mark.parametrize(
    ("smooth", "sharp", "held_nm", "sticks"),
    [  # Amplitude that a fit leaves, on its way and at its end; what is missed at rest.
        ((0.3, 0.3), (0.6, 0.0), 1.0, True),
        ((0.6, 0.0), (0.3, 0.3), 1.0, False),
        ((0.3, 0.3), (0.6, 0.0), 0.0, False),  # there is no reason to look
    ],
)
def test_each_sign_is_judged_by_a_fit_at_its_end(smooth, sharp, held_nm, sticks, monkeypatch):
    """A wrong inertia leaves much in a fit that is on its way, more than the sign does."""
    monkeypatch.setattr("hdsim.estimate.standstill._creeping", lambda *_: None)  # no sign between
    time = np.arange(2000) * 0.005
    speed, wave = 3.0 * np.sin(2.0 * time), np.cos(2.0 * time)
    predictor = SimpleNamespace(
        smoothing=0.5, speed_noise=4e-3, motor_velocity=speed, motor_angle=-1.5 * wave, angle_noise=1e-5
    )
    held = held_nm * (np.abs(speed) < 0.02)
    rows = np.ones(len(time), dtype=bool)
    series = SimpleNamespace(
        channel="motor_torque",
        record=0,
        train=rows,
        hold=~rows,
        sigma=0.1,
        noise=0.1,
        block=np.arange(2000) // 20,
    )
    noise = 0.1 * np.random.default_rng(0).standard_normal(len(time))
    bench = SimpleNamespace(
        predictors=[predictor],
        series=[series],
        predict=lambda _: [np.tanh(speed / predictor.smoothing)],
        residuals=lambda predictions: [noise - predictions[0]],
        power=lambda predictions: float(np.sum((noise - predictions[0]) ** 2) / 0.1**2),
        noise_power=2000.0,
    )
    fits = {
        (sign, end): SimpleNamespace(predictions=[left * wave + held])
        for sign, sizes in (("smooth", smooth), ("sharp", sharp))
        for end, left in zip(("on its way", "at its end"), sizes, strict=True)
    }
    ends = {id(fits[sign, "on its way"]): fits[sign, "at its end"] for sign in ("smooth", "sharp")}
    given = SimpleNamespace(
        drive=SimpleNamespace(friction=SimpleNamespace(sticks=True, coulomb_nm=1.0, load_coefficient=0.0))
    )
    found = hear_standstill(
        bench,
        given,
        bench.predict(given),
        fits["smooth", "on its way"],
        lambda: fits["sharp", "on its way"],
        lambda fit: ends[id(fit)],
    )
    assert found is (fits["sharp", "at its end"] if sticks else fits["smooth", "on its way"])
    assert (predictor.smoothing < 0.01) == sticks
    assert series.train.all() != sticks  # rests count where the sign is smooth


def creeping(base, speed=0.5):
    friction = base.drive.friction.model_copy(update={"smoothing_velocity_rad_per_s": speed})
    return base.model_copy(update={"drive": base.drive.model_copy(update={"friction": friction})})


@pytest.mark.slow
def test_a_drive_that_creeps_is_not_taken_for_one_that_sticks(base):
    bench, series, rest = fitted(recorded(creeping(base)), base)
    counted = series.train | series.hold
    assert bench.predictors[0].smoothing == 0.5
    assert counted[series.block > 0].all()
    assert np.std(rest[counted]) < 1.1 * series.noise


@pytest.mark.slow
def test_a_drive_that_creeps_a_little_before_it_slips_lacks_no_friction(base):
    found = diagnose([recorded(creeping(base, 0.03))], base)
    (predictor,) = found.bench.predictors
    assert predictor.smoothing == pytest.approx(0.03, rel=0.3)
    assert found.verdict.verdict == "nothing"
    gap = found.verdict.gap["motor_torque"]
    assert gap.after < 1.1 * gap.noise


@pytest.mark.slow
def test_where_nothing_is_hidden_sticking_is_no_effect(base, record):
    assert diagnose([record], base).verdict.verdict == "nothing"


def test_a_chosen_smoothing_speed_is_kept(base, record):
    bench, series, _ = fitted(record, creeping(base))
    assert bench.predictors[0].smoothing == 0.5
    assert (series.train | series.hold)[series.block > 0].all()


def test_a_sign_is_smoothed_as_errors_of_the_speed_do():
    rng = np.random.default_rng(0)
    spread, speeds = 0.02, np.linspace(-0.05, 0.05, 5)
    errors = spread * rng.standard_normal((20000, 1))
    smoothing = resolution(float(np.sqrt(np.mean(errors[:, 0] ** 2))))
    mean = np.sign(speeds + errors).mean(axis=0)
    assert np.tanh(speeds / smoothing) == pytest.approx(mean, abs=0.07)


def test_a_sign_is_smoothed_no_more_than_the_effects_are():
    assert resolution(7.0) == 0.5
    assert resolution(0.1) == pytest.approx(0.1 * np.sqrt(np.pi / 2))


def test_rests_and_reversals_take_their_neighbours_along():
    time = np.arange(100) * 0.01
    speed = np.where(time < 0.305, 1.0, np.where(time < 0.505, 0.0, -1.0))
    speed[80:] = 1.0  # turns round between two samples
    found = standing(speed, 0.01)
    assert found[27:55].all()
    assert found[75:85].all()
    assert not found[:26].any()
    assert not found[56:74].any()
    assert not found[86:].any()


def test_of_a_long_rest_no_sample_counts_as_turning():
    """A speed is beyond two standard deviations in one sample of twenty by chance, and a spline swings."""
    rng = np.random.default_rng(5)
    time = np.arange(4000) * 0.001
    wandering = np.convolve(rng.standard_normal(4100), np.hanning(42)[1:], "valid")[:4000]
    speed = 1e-3 * wandering / wandering.std()
    speed[3000:] = 0.05 * (time[3000:] - 3.0)
    speed[2980:3000] = -4e-3  # as a spline swings before a jump
    angle = np.cumsum(speed) * 0.001
    smoothing = 1e-3 * np.sqrt(np.pi / 2.0)
    assert not standing(speed, smoothing)[:2950].all()
    found = standing(speed, smoothing, angle, 2e-4)
    assert found[:3000].all()
    assert not found[3300:].any()


def without_friction():
    none = {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0}
    return Scenario.model_validate(moves.MOVES | {"drive": moves.MOVES["drive"] | {"friction": none}})


@pytest.mark.slow
def test_a_base_without_friction_is_not_asked_for_what_holds_a_shaft_at_rest():
    run = hdsim.simulate(Scenario.model_validate(moves.MOVES))
    verdict = diagnose([noisy(run, moves.NOISE, seed=1)], without_friction()).verdict
    assert [one.name for one in verdict.effects] == ["input_coulomb_viscous"]
    gap = verdict.gap["motor_torque"]
    assert gap.after < 1.2 * gap.noise < 0.1 * gap.before
    true = Scenario.model_validate(moves.MOVES).drive.friction
    viscous = verdict.effects[0].parameters["viscous_nm_s_per_rad"]
    assert viscous.interval[0] < true.viscous_nm_s_per_rad < viscous.interval[1]


@pytest.mark.slow
@pytest.mark.parametrize("held_nm", [0.03, 0.0])
def test_rests_are_left_out_where_more_is_missed_there(held_nm):
    run = hdsim.simulate(Scenario.model_validate(moves.MOVES))
    record = noisy(run, {"motor_angle": 3e-5, "motor_torque": 3e-3}, seed=1)
    bench = bench_for([record], [], without_friction())
    (series,) = bench.series
    counted = series.train | series.hold
    noise = 3e-3 * np.random.default_rng(4).standard_normal(len(record.time))
    rest = np.abs(bench.predictors[0].motor_velocity) < 0.3
    held = held_nm * rest * np.where(record.time % 1.0 < 0.5, 1.0, -1.0)
    found = SimpleNamespace(predictions=[series.measured - noise - held])
    assert leave_out_rest(bench, found) == (held_nm > 0)
    now = series.train | series.hold
    assert not now[rest].any() if held_nm else np.array_equal(now, counted)
    assert not leave_out_rest(bench, found)  # nor again: it would begin anew for ever


@pytest.mark.study
def test_beside_an_effect_what_holds_a_shaft_is_no_friction_that_remembers():
    """Behind the kinematic error nothing more is missed at rest; LuGre friction would be the next name."""
    error = {"components": [{"order": 2, "amplitude_arcmin": 0.6, "phase_deg": 30.0}]}
    longer = moves.MOVES | {"run": moves.MOVES["run"] | {"duration_s": 8.0}}
    run = hdsim.simulate(Scenario.model_validate(longer | {"effects": {"kinematic_error": error}}))
    verdict = diagnose([noisy(run, moves.NOISE, seed=1)], Scenario.model_validate(longer)).verdict
    assert [one.name for one in verdict.effects] == ["kinematic_error"]
    assert verdict.gap["motor_torque"].after < 1.2 * verdict.gap["motor_torque"].noise


TWISTED = {
    "drive": {"preset": "csg-20-50", "mesh": {"model": "lumped"}},
    "command": {"motor": {"type": "free"}, "output": {"type": "locked"}},
    "load": {"inertia_kg_m2": 0.05},
    "run": {"duration_s": 1.0},
}


def crept(base: Scenario) -> Record:
    """A motor that winds up a locked drive slowly, stops, and is held by its Coulomb friction there."""
    friction, ratio = base.drive.friction, base.drive.ratio
    time = np.arange(0.0, 12.0, 0.002)
    # Half a second of way, half a second of rest.
    phase = np.minimum(np.mod(time, 1.0) / 0.5, 1.0)
    up = np.where(np.floor(time) % 4 < 2, 1.0, -1.0)
    way = 0.01 * 0.5 * (1.0 - np.cos(np.pi * phase)) * up
    angle = np.cumsum(np.diff(way, prepend=0.0) * (phase < 1.0))
    speed = np.gradient(angle, time)
    torque = base.drive.torsion.stiffness_k1_nm_per_rad * angle / ratio
    assert np.abs(torque).max() < base.drive.torsion.torque_t1_nm
    moving = np.abs(speed) > 1e-6
    loss = friction.coulomb_nm + friction.load_coefficient * np.abs(torque / ratio)
    # At rest the motor takes part of its torque back: anything within the friction holds.
    held = np.where(moving, np.sign(speed), -0.3 * up)
    rng = np.random.default_rng(3)
    return Record("crept", time, {
        "motor_angle": angle + 2e-5 * rng.standard_normal(len(time)),
        "motor_torque": torque / ratio + held * loss + 1e-3 * rng.standard_normal(len(time)),
        "output_torque": torque + 0.01 * rng.standard_normal(len(time)),
    })  # fmt: skip


def test_a_drive_that_creeps_and_rests_keeps_its_friction():
    """So slow that the smooth sign is hardly friction: its fit bends friction, and looks no worse for it."""
    base = Scenario.model_validate(TWISTED)
    bench = bench_for([crept(base)], [], base, None)
    found = {one.name: one for one in refit(bench, state_of(base)).intervals}
    assert bench.predictors[0].smoothing < 0.05
    value = found["drive.friction.coulomb_nm"].value
    assert value == pytest.approx(base.drive.friction.coulomb_nm, rel=0.05)
