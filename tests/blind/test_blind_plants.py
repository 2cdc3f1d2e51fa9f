"""The plants themselves: conservation laws, statics, agreement with the model that is to fit them."""

import numpy as np
import pytest
from cases import Case, Trial, case_of, trials
from drives import DRIVES
from hidden import EFFECTS
from judging import base_of, judge
from motions import CONTROL_RATE
from plants import spring_table
from sensing import CHANNELS, Setup, measure, numbers, readings, truth
from strength import strength

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


def compared(setup: Setup, changes: dict[str, float], effects=None) -> dict[str, float]:
    """RMS difference of the plant and hdsim's prediction over the noise, by channel."""
    p = numbers(setup, changes)
    ideal = {name: v[:: CONTROL_RATE // setup.rate] for name, v in readings(p, truth(setup, p)).items()}
    time = np.arange(len(ideal["motor_angle"])) / setup.rate
    record = Record("blind", time, {c: ideal[c] for c in CHANNELS})
    scenario = base_of(Case(Trial("null", "nothing", 0), setup, {}))
    predictor = predictors([record], scenario.drive.ratio, output_locked=setup.locked)[0]
    model = state_of(scenario).candidate()
    found = predictor.predict(Candidate(model.drive, effects or {}, model.load))
    noises = setup.noises()
    rest = {c: (ideal[c] - values)[round(0.2 * setup.rate) : -20] for c, values in found.items()}
    return {c: float(np.std(values) / noises[c]) for c, values in rest.items()}


@pytest.mark.parametrize("k", range(len(DRIVES)))
def test_a_plant_without_an_effect_is_the_base_model(k):
    """A base YAML and a plant that disagree would make every answer wrong, and every null a lie."""
    rest = compared(setup_of(k), {})
    # Two of the drives smooth the sign of their friction by another formula than the model.
    assert rest.pop("motor_torque") < (0.25 if DRIVES[k].algebraic_sign else 0.12)
    # Where a locked drive is unwound is estimated from its log, which shifts its torque a little.
    assert max(rest.values()) < (0.4 if setup_of(k).locked else 0.03)


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
def test_the_numbers_to_recover_are_those_of_the_plant(hidden):
    """Put into the catalogue's effect, the numbers that count as the truth reproduce the plant's trace."""
    k = 4 if "locked" not in hidden.motions else 1
    setup = setup_of(
        k, motion="moves", lacks=hidden.lacks, seconds=6.0, speed=hidden.speed, noise=0.5, rate=2000
    )
    changes = hidden.build(setup.drive, np.full(6, 0.3), 2.0 * hidden.start, True)
    name, label = OWN_NAME.get(hidden.name, (hidden.name, ""))
    expected = hidden.expected(setup.drive, changes)
    effect = catalogue()[name](**settings_of(name, label, expected))
    trace = strength(setup, changes)
    rest = compared(setup, changes, {name: effect})
    assert trace.plain > 0.1
    assert max(rest.values()) < max(0.05 * trace.plain, 0.1), (rest, trace)


def test_a_case_follows_from_its_key_and_has_its_strength():
    trial = Trial("fair", "stribeck_friction", 1, ("stribeck_friction",))
    first, again = case_of(trial), case_of(trial)
    assert first == again
    assert first.strengths[0].beyond_base == pytest.approx(2.0, rel=0.2)
    assert first.strengths[0].plain >= first.strengths[0].beyond_base
    logs = [measure(c.setup, numbers(c.setup, c.changes)) for c in (first, again)]
    assert all(np.array_equal(logs[0].channels[c], logs[1].channels[c]) for c in logs[0].channels)
    other = case_of(Trial("fair", "stribeck_friction", 2, ("stribeck_friction",)))
    assert other.setup != first.setup


def test_the_matrix_is_as_wide_as_it_says():
    found = list(trials(range(100, 103)))
    assert len({t.key for t in found}) == len(found) >= 300
    count = {g: sum(t.group == g for t in found) for g in {t.group for t in found}}
    quiet = sum(not t.effects for t in found)
    assert quiet >= 100
    least = {"clear": 60, "fair": 50, "faint": 40, "pair": 20, "outside": 25, "missing": 20, "dirty": 15}
    assert all(count[group] >= number for group, number in least.items()), count
    named = {name for effect in EFFECTS for name in (effect.accepted or (effect.name,))}
    assert named >= {name for name, effect in catalogue().items() if effect.fittings}


def test_judging():
    clear = Trial("clear", "stribeck_friction", 0, ("stribeck_friction",))
    faint = Trial("faint", "stribeck_friction", 0, ("stribeck_friction",))
    pair = Trial("pair", "", 0, ("stribeck_friction", "kinematic_error"))
    assert judge(clear, "effect", [["lugre_friction", "stribeck_friction"], ["unbalance"]])
    assert not judge(clear, "effect", [["unbalance"], ["stribeck_friction"]])
    assert not judge(clear, "effect", [["a", "b", "c", "stribeck_friction"]])
    assert not judge(clear, "unknown", [])
    assert judge(faint, "nothing", [])
    assert not judge(faint, "effect", [["unbalance"]])
    assert judge(pair, "effect", [["kinematic_error"], ["stribeck_friction"]])
    assert not judge(pair, "effect", [["kinematic_error"]])
    assert judge(Trial("outside", "cable", 0, ("cable",)), "unknown", [])
    assert not judge(Trial("null", "nothing", 0), "unknown", [])
    assert not judge(Trial("parameter", "mass", 0, parameters=("mass",)), "nothing", [])
