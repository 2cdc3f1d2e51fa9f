"""The families in MuJoCo and of hdsim's own teeth: closed forms, reproducibility, ranges, true nulls."""

import math
from collections import Counter
from dataclasses import replace

import family_teeth
import family_toothed
import numpy as np
import pytest
from contract import Case
from drawing import RATES, SENSORS, draw_drive, draw_lengths, draw_sensing, visible
from moving import MOTIONS, motion
from toothed_plant import Teeth

from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

#: Root-mean-square of what the base leaves over the noise, quantisation included: nothing, or a little.
NOTHING, MOST = 1.1, 1.2
FREE = {"coulomb": 0.0, "viscous": 0.0, "load_loss": 0.0, "damping": 0.0}


@pytest.fixture(scope="module")
def mujoco_family():
    pytest.importorskip("mujoco", minversion="4.0")
    import family_mujoco

    return family_mujoco


@pytest.fixture(scope="module")
def mujoco_plant():
    pytest.importorskip("mujoco", minversion="4.0")
    import mujoco_plant

    return mujoco_plant


def free_motion(plant, seconds: float):
    """What a plant without a controller is told: nothing, and a row of the log every step."""
    steps = round(seconds * plant.STEP_HZ)
    return plant.Motion(np.zeros((steps, 2)), np.zeros(steps), 1, 1)


def test_two_masses_on_a_spring_ring_at_their_frequency(mujoco_plant):
    """f = sqrt(k (1/(J_m i^2) + 1/J_l))/(2 pi), Den Hartog 1956, Mechanical Vibrations, sec. 2."""
    for ratio, load in ((-100.0, 0.5), (50.0, 0.035), (160.0, 12.0)):
        p = mujoco_plant.Numbers(ratio=ratio, load_inertia=load, **FREE)
        log = mujoco_plant.simulate(p, free_motion(mujoco_plant, 1.0), free=2e-4)
        twist = log[:, 0] / ratio - log[:, 2]
        up = np.flatnonzero((twist[:-1] < 0) & (twist[1:] >= 0))
        at = (up - twist[up] / (twist[up + 1] - twist[up])) / mujoco_plant.STEP_HZ
        expected = math.sqrt(p.k1 * (1 / (p.motor_inertia * ratio**2) + 1 / load)) / (2 * math.pi)
        assert (len(at) - 1) / (at[-1] - at[0]) == pytest.approx(expected, rel=0.01)


#: Springs of a lossless plant. Of its elastic energy RK4 may lose nothing in 2 s with the smooth one; at the
#: other's corners only its second order is left.
CORNERS = {"k2": 2.5e4, "k3": 2.9e4, "gap": 1e-4}
SMOOTH = {"k2": 1.6e4, "k3": 1.6e4}
ERROR = {"ke_1": 1e-4, "ke_2": 2e-4, "ke_4": 1e-4, "ke_rel": 1e-4, "ke_out": 1e-3, "dent": -2e-4}


@pytest.mark.parametrize(
    ("spring", "step_hz", "lost"), [(SMOOTH, 5000, 1e-4), (CORNERS, 5000, 6e-3), (CORNERS, 20000, 1e-3)]
)
def test_a_plant_without_losses_conserves_energy(mujoco_plant, monkeypatch, spring, step_hz, lost):
    """Kinetic, elastic and potential energy while the wave generator turns four times through its error."""
    monkeypatch.setattr(mujoco_plant, "STEP_HZ", step_hz)
    monkeypatch.setattr(mujoco_plant, "STEP", 1.0 / step_hz)
    p = mujoco_plant.Numbers(arm=3.0, lever=0.1, **FREE, **ERROR, **spring)
    told = free_motion(mujoco_plant, 2.0)
    told.reference[:, 1] = -0.4  # speed at the start
    log = mujoco_plant.simulate(p, told, free=3e-3)
    m, wm, o, wo = log[:, :4].T
    twist = m / p.ratio - o + np.array([mujoco_plant.error_at(p, *at) for at in zip(m, o, strict=True)])
    twists = np.linspace(0.0, 1.01 * np.abs(twist).max(), 20001)
    torque = np.interp(twists, *table(mujoco_plant, p))
    stored = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(twists))])
    elastic = np.interp(np.abs(twist), twists, stored)
    energy = 0.5 * p.motor_inertia * wm**2 + 0.5 * p.load_inertia * wo**2
    energy += p.arm * (1 - np.cos(o)) + elastic
    assert np.ptp(energy) < lost * np.ptp(elastic)
    assert np.ptp(m) > 8 * np.pi


def table(plant, p) -> tuple[np.ndarray, np.ndarray]:
    """Twist and torque of the chain, from the compliances alone."""
    torques = np.concatenate([[0.0], np.geomspace(1e-6, 6 * p.t2, 20000)])
    twists = np.interp(
        torques,
        [0.0, p.t1, p.t2, 6 * p.t2],
        np.cumsum([0.0, p.t1 / p.k1, (p.t2 - p.t1) / p.k2, 5 * p.t2 / p.k3]),
    )
    return twists + 0.5 * p.gap, torques


def test_a_prescribed_motion_takes_the_torque_that_made_it(mujoco_plant):
    """Strengths rest on that: the same plant along its own motion reads the same."""
    p = mujoco_plant.Numbers(arm=12.0, lever=0.2, ke_2=1e-4, slip=1.0, cogging=0.01, gap=2e-5, stribeck=0.01)
    angle, speed = motion("moves", 4.0, 0.8, np.random.default_rng(1), tick_hz=1000, smooth_s=0.06)
    told = mujoco_plant.Motion(np.column_stack([angle, speed]), np.zeros(5 * len(angle)), 5, 1)
    log = mujoco_plant.simulate(p, told)
    again = mujoco_plant.simulate(p, told, log)
    assert np.abs(again[:, 2] - log[:, 2])[500:].max() < 1e-8
    assert np.abs(again[:, 5] - log[:, 5])[500:].max() < 5e-3 * np.ptp(log[:, 5])


def left(case: Case) -> dict[str, list[float]]:
    """Root-mean-square of what the base leaves of each record over the noise, by channel."""
    scenario = scenario_of(case.base)
    found: dict[str, list[float]] = {}
    for one in (*case.records, *case.holdout):
        record = Record(one.name, one.time, dict(one.channels))
        predictor = predictors([record], scenario.drive.ratio, load=case.load)[0]
        for channel, values in predictor.predict(state_of(scenario).candidate()).items():
            if channel in record.channels:
                rest = (record.channels[channel] - values)[record.time > 0.05]
                size = float(np.std(rest)) / case.setup["noise"][channel]
                found.setdefault(channel, []).append(size)
    return found


def scenario_of(text: str) -> Scenario:
    import tempfile
    from pathlib import Path

    import hdsim

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "base.yaml"
        path.write_text(text, encoding="utf-8")
        return hdsim.load_scenario(path)


def check_null(case: Case) -> None:
    """One record may by chance be a little louder than its noise; all of a channel's together may not."""
    assert case.kind == "null"
    assert not case.truth
    for channel, sizes in left(case).items():
        assert max(sizes) < MOST, (case.key, channel, sizes)
        assert float(np.mean(sizes)) < NOTHING, (case.key, channel, sizes)
        assert min(sizes) > 0.85, (case.key, channel, sizes)


#: Nulls, two of which are drawn each time.
NULLS = [
    pytest.param(number, marks=[] if number in (0, 32) else pytest.mark.study) for number in range(0, 80, 16)
]


@pytest.mark.slow
@pytest.mark.parametrize("number", NULLS)
def test_a_mujoco_null_is_null(mujoco_family, number):
    check_null(mujoco_family.draw(number, 1))


@pytest.mark.slow
@pytest.mark.parametrize("number", NULLS)
def test_a_toothed_null_is_null(number):
    check_null(family_toothed.draw(number, 1))


def check_case(case: Case, family: str) -> None:
    assert case.family == family
    assert case.key.startswith(f"{family}/{case.kind}/")
    assert 1 <= len(case.records) <= 4
    assert bool(case.holdout) == (case.setup["held"] == "files")
    assert scenario_of(case.base).drive.ratio == pytest.approx(case.setup["ratio"])
    assert len(case.truth) == {"effect": 1, "pair": 2}.get(case.kind, 0)
    assert len(case.strength) == {"null": 0, "pair": 2}.get(case.kind, 1)
    for record in (*case.records, *case.holdout):
        assert set(record.channels) == set(record.ideal) >= set(SENSORS[case.setup["sensors"]])
        assert np.allclose(np.diff(record.time), 1 / case.setup["rate_hz"])
        assert 4.8 < record.time[-1] < 60.0
        assert all(np.all(np.isfinite(values)) for values in record.channels.values())


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, *(pytest.param(n, marks=pytest.mark.study) for n in (3, 7))])
def test_a_mujoco_case_follows_from_number_and_seed(mujoco_family, number):
    first, again = mujoco_family.draw(number, 0), mujoco_family.draw(number, 0)
    check_case(first, "mujoco")
    assert same(first, again)
    if number == 1:
        # By what is drawn: a key has its seed in it, whatever the case is.
        assert first.base != mujoco_family.draw(number, 1).base


@pytest.mark.slow
@pytest.mark.parametrize("number", [pytest.param(1, marks=pytest.mark.study), 6])
def test_a_toothed_case_follows_from_number_and_seed(number):
    first, again = family_toothed.draw(number, 0), family_toothed.draw(number, 0)
    check_case(first, "toothed")
    assert same(first, again)


@pytest.mark.slow
@pytest.mark.parametrize("number", [pytest.param(1, marks=pytest.mark.study), 4])
def test_a_case_with_a_base_that_has_teeth_follows_from_number_and_seed(number):
    first, again = family_teeth.draw(number, 0), family_teeth.draw(number, 0)
    check_case(first, "teeth")
    assert same(first, again)
    assert scenario_of(first.base).drive.mesh.model == "tabulated"


def test_a_wider_gap_is_before_the_same_structure():
    """A plant's cup and bearing are the base's, whatever its catalogue's secants say."""
    d = draw_drive(np.random.default_rng(3), arm=True)
    plain = family_teeth.Drawn("teeth", "static", 1.0, 5)
    wide = replace(plain, gap=2.5)
    other = family_teeth.behind_the_same_structure(d, plain, wide)
    torque = np.array([0.5 * d.torques[0], d.torques[0], d.torques[1], 1.5 * d.torques[1]])
    (first, _), (second, _) = (
        family_teeth.mesh_of(family_teeth.with_teeth(*pair)) for pair in ((d, plain), (other, wide))
    )
    assert second.half_gaps_m == pytest.approx(2.5 * first.half_gaps_m)
    assert second.structure_wind_up(torque) == pytest.approx(first.structure_wind_up(torque), rel=1e-6)


def same(a: Case, b: Case) -> bool:
    pairs = zip((*a.records, *a.holdout), (*b.records, *b.holdout), strict=True)
    equal = all(np.array_equal(x.channels[c], y.channels[c]) for x, y in pairs for c in x.channels)
    return equal and (a.key, a.base, a.strength, a.numbers) == (b.key, b.base, b.strength, b.numbers)


@pytest.mark.slow
def test_what_is_hidden_is_seen_and_a_wrong_name_is_absorbed(mujoco_family):
    """A base's own number that is off has no strength beyond the base's numbers; an effect keeps some."""
    rng = np.random.default_rng(5)
    x = mujoco_family.draw_experiment(rng, (), ("mass",))
    seen = mujoco_family.Visibility(x)
    plain, beyond = seen.of(
        {"coulomb": 1.05 * x.drive.coulomb, "motor_inertia": 1.05 * x.drive.motor_inertia}
    )
    assert beyond < 0.02 * plain
    plain, beyond = seen.of({"cogging": 0.2 * x.drive.coulomb})
    assert beyond > 0.5 * plain > 0.1


def test_strength_is_what_least_squares_leave():
    t = np.linspace(0.0, 1.0, 1001)
    trace = np.array([3.0 + np.sin(20 * np.pi * t), 0.0 * t])
    assert visible(trace, []) == pytest.approx((1 / math.sqrt(2),) * 2, rel=1e-3)
    column = np.array([np.sin(20 * np.pi * t), 0.0 * t])
    assert visible(trace, [column])[1] < 1e-9


def test_the_gap_of_the_flanks_is_as_wide_as_it_says():
    """Heights of a Weierstrass-Mandelbrot profile scale with the gap that is asked for."""
    from hdsim.drive.presets import PRINTED_FLANKS
    from hdsim.surface.parameters import RoughFlanks

    drive = draw_drive(np.random.default_rng(0), arm=False)
    nominal = RoughFlanks.model_validate(PRINTED_FLANKS | {"seed": 3}).half_gaps(200, 0).mean()
    # What the kept cases were drawn with, whatever the default drive's flanks are.
    assert nominal == pytest.approx(1.42e-6, rel=0.06)
    assert Teeth("teeth", "static", 1.0, 3).section(drive)["flanks"] == PRINTED_FLANKS | {"seed": 3}
    for gap in (0.5, 1.0, 3.0):
        section = Teeth("teeth", "static", gap, 3).section(drive)["flanks"]
        assert RoughFlanks(**section).half_gaps(200, 0).mean() == pytest.approx(gap * nominal, rel=0.15)


def test_draws_are_as_wide_as_they_say():
    rng = np.random.default_rng(0)
    drives = [draw_drive(rng, arm=bool(k % 2)) for k in range(300)]
    assert {d.size for d in drives} == {14, 17, 20, 25, 32, 40, 45, 50}
    assert {int(abs(d.ratio)) for d in drives} >= {50, 100, 160}
    assert 0.4 < np.mean([d.ratio > 0 for d in drives]) < 0.6
    assert all(d.arm / 9.80665 * d.lever < 0.51 * d.load_inertia for d in drives)
    sensing = [draw_sensing(rng, d) for d in drives]
    assert {s.rate for s in sensing} == set(RATES)
    assert {s.kind for s in sensing} == set(SENSORS)
    coarse = np.array([s.coarseness for s in sensing])
    assert coarse.min() < 0.1
    assert coarse.max() > 7.0
    assert np.all((coarse > 0.049) & (coarse < 10.1))
    lengths = [draw_lengths(rng, s.rate) for s in sensing]
    seconds = np.array([s for given, _, _ in lengths for s in given])
    assert 5.0 <= seconds.min() < 6.0
    assert 30.0 < seconds.max() <= 60.0
    assert np.mean(seconds > 30.0) < 0.1
    assert 0.5 < np.mean([how == "files" for _, _, how in lengths]) < 0.7
    assert set(Counter(len(given) for given, _, _ in lengths)) == {1, 2, 3, 4}
    for kind in MOTIONS:
        angle, speed = motion(kind, 8.0, 0.7, rng, tick_hz=1000, smooth_s=0.06)
        assert np.abs(speed).max() < 0.71
        assert np.allclose(np.gradient(angle, 1e-3), speed, atol=0.01)
