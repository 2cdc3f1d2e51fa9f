"""The plants themselves: conservation laws, statics, agreement with the model that is to fit them."""

from pathlib import Path

import numpy as np
import pytest
from drives import DRIVES, around, base_yaml
from hidden import EFFECTS
from motions import CONTROL_RATE
from plant_springs import spring_table
from sensing import SENSORS, Setup, measure, numbers, readings, truth
from strength import plain_strength, unresolved

import hdsim
from hdsim.effects import catalogue
from hdsim.estimate.predict import Candidate, predictors
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.nested import put

MOTIONS = ("swing", "moves", "chirp", "constant", "locked", "moves")


def setup_of(k: int, **changes) -> Setup:
    given = {"drive": DRIVES[k], "motion": MOTIONS[k], "gravity": True, "rate": 1000, "seconds": 6.0,
             "seed": (k, 3)}  # fmt: skip
    return Setup(**(given | changes))


@pytest.fixture
def compared(tmp_path):
    """RMS difference of the plant and hdsim's prediction over the noise, by channel."""
    return lambda *given: _compared(tmp_path / "base.yaml", *given)


def _compared(path: Path, setup: Setup, changes: dict[str, float], effects=None) -> dict[str, float]:
    p = numbers(setup, changes)
    ideal = {name: v[:: round(CONTROL_RATE / setup.rate)] for name, v in readings(p, truth(setup, p)).items()}
    time = np.arange(len(ideal["motor_angle"])) / setup.rate
    record = Record("blind", time, {c: ideal[c] for c in setup.channels})
    path.write_text(base_yaml(setup.drive, gravity=setup.gravity, locked=setup.locked, lacks=setup.lacks))
    scenario = hdsim.load_scenario(path)
    predictor = predictors([record], scenario.drive.ratio, locked="output" if setup.locked else "")[0]
    model = state_of(scenario).candidate()
    found = predictor.predict(Candidate(model.drive, effects or {}, model.load))
    noises = setup.noises()
    rest = {c: (ideal[c] - values)[round(0.2 * setup.rate) : -20] for c, values in found.items()}
    return {c: float(np.std(values) / noises[c]) for c, values in rest.items()}


@pytest.mark.parametrize("algebraic", [False, True])
@pytest.mark.parametrize("k", range(len(DRIVES)))
def test_a_plant_without_an_effect_is_the_base_model(k, algebraic, compared):
    """A base YAML and a plant that disagree would make every answer wrong, and every null a lie."""
    setup = setup_of(k, algebraic_sign=algebraic and MOTIONS[k] != "locked")
    rest = compared(setup, {})
    # Where friction changes sign by another formula than the model's, that hides in the noise.
    assert rest.pop("motor_torque") < (0.3 if setup.algebraic_sign else 0.15)
    # Where a locked drive is unwound, and where the output's encoder has its zero beside the motor's, is
    # estimated from the log, which shifts a torque, or the angle of a weight, a little.
    assert max(rest.values()) < (0.4 if setup.locked else 0.05)


@pytest.mark.parametrize("sensors", SENSORS)
def test_sensors_read_the_plant_with_the_noise_that_they_are_said_to_have(sensors, compared):
    drive = around(DRIVES[1], (0.1, 0.9, 0.3, 0.5, 0.7, 0.2, 0.8, 0.6))
    setup = setup_of(1, drive=drive, motion="swing", sensors=sensors, rate=1000, step=6.0, noise=0.7)
    assert max(compared(setup, {}).values()) < 0.2
    log = measure(setup, numbers(setup, {}), "a")
    assert set(log.channels) == set(SENSORS[sensors]) == set(log.ideal)
    noises = setup.noises()
    for channel, values in log.channels.items():
        assert np.std(values - log.ideal[channel]) == pytest.approx(noises[channel], rel=0.1), channel
    steps = np.unique(np.abs(np.diff(log.channels["motor_angle"])))
    step = steps[steps > 1e-12].min()
    assert step == pytest.approx(6.0 * noises["motor_angle"] / np.hypot(1.0, 6.0 / np.sqrt(12)), rel=1e-6)


def test_a_known_load_moves_the_output_as_statics_say():
    """A motor that stands still: the spring's twist is that of the known torque and the arm's weight."""
    setup = setup_of(4, motion="swing", sensors="known load", gravity=False, seconds=8.0, speed=1e-6)
    p = numbers(setup, {})._replace(load_inertia=1e-3, k1=1e5, k2=1e5, k3=1e5)
    log = truth(setup, p)
    read = readings(p, log)
    twist = read["motor_angle"] / p.ratio - read["output_angle"]
    assert np.ptp(read["load_torque"]) > 10
    # The load turns the output on, against the spring: the spring carries minus the load.
    assert np.abs(twist * 1e5 + read["load_torque"])[2000:].max() < 0.02 * np.ptp(read["load_torque"])


def test_a_log_that_is_too_slow_for_its_motion_is_told_from_one_that_is_not():
    ripple = {"ripple_a": 0.05, "ripple_a_order": 12.0}
    fast, slow = (setup_of(0, rate=rate, motion="swing") for rate in (2000, 100))
    assert unresolved(fast, ripple) < 0.2
    assert unresolved(slow, {}) < 0.3 < 1.0 < unresolved(slow, ripple)


def test_a_plants_damper_bridges_its_play_as_grease_in_the_gap_does(compared):
    """A load that swings through its play: nearly all that damps it is what acts in the gap."""
    setup = setup_of(2, motion="chirp", sensors="torque sensor", gravity=False, rate=2000, noise=0.5)
    changes = {"gap": 2.5e-4, "gap_rounding": 0.0}
    backlash = catalogue()["output_backlash"]
    size = {"backlash_arcmin": np.degrees(changes["gap"]) * 60.0}
    dry, greased = (
        compared(setup, changes, {"output_backlash": backlash(**size, film_share=share)}) for share in (0, 1)
    )
    # The zero between the encoders, which the play turns, is estimated from the log.
    assert max(greased.values()) < 0.3
    assert dry["output_angle"] > 3.0


def test_a_plant_without_losses_conserves_energy():
    """What the motor puts in is kinetic, elastic and potential energy, whatever the kinematic error does."""
    setup = setup_of(1, motion="swing")
    lossless = dict.fromkeys(("coulomb", "viscous", "load_loss", "damping"), 0.0)
    error = {"ke_2": 1e-4, "ke_rel": 1e-4, "ke_out3": 1e-3, "out_once": 1e-3, "wg_once": 1e-4,
             "wg_once_skew": 0.3, "bump": -2e-4}  # fmt: skip
    p = numbers(setup, lossless | error)
    m, torque, o, tau, _, wm, _ = truth(setup, p).T
    table, reach = spring_table(p)
    twists = np.linspace(-reach, reach, len(table))
    stored = np.concatenate([[0.0], np.cumsum(0.5 * (table[1:] + table[:-1]) * np.diff(twists))])
    stored -= np.interp(0.0, twists, stored)
    wo = np.gradient(o, 1.0 / CONTROL_RATE)
    work = np.concatenate([[0.0], np.cumsum(torque[:-1] * np.diff(m))])
    twist = np.interp(tau, table, twists)
    energy = 0.5 * p.motor_inertia * wm**2 + 0.5 * p.load_inertia * wo**2
    energy += p.arm * (1 - np.cos(o)) + np.interp(twist, twists, stored)
    rest = (energy - work)[10:-10]
    assert np.ptp(rest) < 2e-3 * np.ptp(energy)
    # Without the error's reaction on the motor the balance would be off by far more.
    assert np.ptp(p.ratio * 2 * p.ke_2 * tau) > 1e-3


def test_friction_at_constant_speed_and_stiffness_at_rest():
    drive = DRIVES[5]
    setup = setup_of(5, motion="constant", gravity=False, seconds=20.0)
    p = numbers(setup, {})
    _, torque, _, tau, _, speed, acceleration = truth(setup, p).T
    steady = (np.abs(acceleration) < 1e-3 * np.abs(acceleration).max()) & (np.abs(speed) > 3)
    torque = torque - p.motor_inertia * acceleration
    wanted = (drive.coulomb + drive.load_loss * np.abs(tau / drive.ratio)) * np.sign(
        speed
    ) + drive.viscous * speed
    assert steady.sum() > 1000
    assert np.abs(torque + tau / -drive.ratio - wanted)[steady].max() < 0.01 * drive.coulomb
    table, reach = spring_table(p)
    (k1, k2, k3), (t1, t2) = drive.stiffness, drive.torques
    twist = t1 / k1 + (t2 - t1) / k2 + 10.0 / k3
    assert np.interp(twist, np.linspace(-reach, reach, len(table)), table) == pytest.approx(
        t2 + 10.0, rel=1e-4
    )


def settings_of(name: str, label: str, expected: dict[str, float]) -> dict:
    """Fields of the catalogue's effect with the values that a diagnosis should recover."""
    # Of the slip twists that are tried, the plant's are the last.
    fittings = catalogue()[name].fittings[:: -1 if name == "torsional_hysteresis_maxwell" else 1]
    data: dict = {}
    for fitting in fittings:
        if not label or fitting.label.startswith(label):
            for path, value in fitting.settings.items():
                data[path] = (
                    [dict(v) for v in value] if isinstance(value, list) and path == "components" else value
                )
            break
    for path, value in expected.items():
        section = path.partition(".0.")[0]
        if ".0." in path and section in ("components", "output_torque.ripple"):
            holder = data
            for key in section.split(".")[:-1]:
                holder = holder.setdefault(key, {})
            holder.setdefault(section.rpartition(".")[2], [{}])
        put(data, path, value)
    if name == "sensors":
        data = {k: v for k, v in data.items() if any(path.startswith(k) for path in expected)}
    return data


OWN_NAME = {
    "output encoder eccentricity": ("sensors", "output encoder ecc"),
    "output encoder delay": ("sensors", "output encoder delay"),
    "torque-sensor ripple": ("sensors", "torque-sensor"),
    "unbalance of the rotor": ("unbalance", "motor"),
}


@pytest.mark.slow
@pytest.mark.parametrize("hidden", EFFECTS, ids=lambda hidden: hidden.name)
def test_the_numbers_to_recover_are_those_of_the_plant(hidden, compared):
    """Put into the catalogue's effect, the numbers that count as the truth reproduce the plant's trace."""
    k = 4 if "locked" not in hidden.motions else 1
    setup = setup_of(
        k, motion="moves", lacks=hidden.lacks, speed=hidden.speed, noise=0.5, torque_noise=0.5, rate=2000,
        temperature=hidden.temperature,
    )  # fmt: skip
    changes = hidden.build(setup.drive, np.full(6, 0.3), 2.0 * hidden.start, True)
    name, label = OWN_NAME.get(hidden.name, (hidden.name, ""))
    expected = hidden.expected(setup.drive, changes)
    effect = catalogue()[name](**settings_of(name, label, expected))
    trace = plain_strength(setup, changes)
    rest = compared(setup, changes, {name: effect})
    assert trace.plain > 0.1
    # A play turns the zero between the encoders, which is estimated from the log, by a tenth of the noise.
    assert max(rest.values()) < max(0.05 * trace.plain, 0.12), (rest, trace)
