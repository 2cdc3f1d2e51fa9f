"""Models that are linearised beside one that is simulated: against formulas and against runs of their own."""

import cmath
from dataclasses import replace

import numpy as np
import pytest

from hdsim.actuation.shapes import Hold, Ramp
from hdsim.actuation.signal_data import SignalData
from hdsim.actuation.waves import Sine
from hdsim.drive import _layout as layout
from hdsim.drive.model import Model
from hdsim.scenario import Scenario
from hdsim.simulation.rosenbrock import rodas4_through
from hdsim.simulation.sample import _beside, alike, sample, samples_beside

STIFFNESS, DAMPING, INERTIA, TORQUE = 2e4, 6.0, 0.5, 10.0
TIMES = np.arange(0.0, 0.6, 1e-3)
CHANNELS = ("motor_torque", "output_angle", "output_torque", "transmission_error")
#: Part by which each number is moved; for runs of their own, whose noise does not cancel, a wider one. Not
#: wider than needed: the spring's corners move with it, and torques change there at once.
STEP, WIDE = 1e-8, 3e-5


def drive(**torsion):
    return {
        "preset": "csg-20-100",
        "mesh": {"model": "lumped"},
        "torsion": {
            "stiffness_k1_nm_per_rad": STIFFNESS,
            "stiffness_k2_nm_per_rad": STIFFNESS,
            "stiffness_k3_nm_per_rad": STIFFNESS,
            "damping_nm_s_per_rad": DAMPING,
        }
        | torsion,
        "friction": {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0},
    }


def model_of(drive, effects=None, load=None, motion=None):
    scenario = Scenario.model_validate({
        "drive": drive,
        "effects": effects or {},
        "command": {"motor": {"type": "free"}},
        "load": load or {"inertia_kg_m2": INERTIA},
        "run": {"duration_s": 1.0},
    })  # fmt: skip
    motor = SignalData(Ramp(velocity=300.0).move()) if motion is None else motion
    return Model(
        scenario.drive.resolved(),
        [*scenario.effects.active().values(), scenario.load],
        load_inertia_kg_m2=scenario.load.inertia_kg_m2,
        motions={"motor": motor},
        audited=False,
    )


def ringing(inertia, stiffness, damping):
    """Angle of an output at rest on which a constant torque begins to act: a damped oscillation."""
    decay = damping / (2.0 * inertia)
    turn = cmath.sqrt(stiffness / inertia - decay**2)
    waves = [
        cmath.exp(-decay * t) * (cmath.cos(turn * t) + decay / turn * cmath.sin(turn * t)) for t in TIMES
    ]
    return TORQUE / stiffness * (1.0 - np.array(waves))


@pytest.mark.parametrize(("rtol", "within"), [(1e-6, 1e-2), (1e-9, 2e-4)])
@pytest.mark.parametrize("field", ["stiffness", "damping", "inertia"])
def test_a_ringing_output_changes_as_its_formula_says(field, rtol, within):
    torque = {"type": "hold", "torque_nm": TORQUE}
    there = {"inertia": INERTIA, "stiffness": STIFFNESS, "damping": DAMPING}

    def at(numbers):
        torsion = {f"stiffness_k{k}_nm_per_rad": numbers["stiffness"] for k in (1, 2, 3)}
        torsion["damping_nm_s_per_rad"] = numbers["damping"]
        load = {"inertia_kg_m2": numbers["inertia"], "torque": torque}
        return model_of(drive(**torsion), load=load, motion=SignalData(Hold().move()))

    here, near = samples_beside(
        at(there), [at(there | {field: there[field] * (1.0 + STEP)})], TIMES, ["output_angle"], rtol=rtol
    )
    # The formula's own derivative, by a complex step (Squire and Trapp 1998, SIAM Review 40:110).
    numbers = there | {"inertia": at(there).inertias[2]}
    far = here["output_angle"] - ringing(**numbers).real
    assert np.max(np.abs(far)) < 20 * rtol * TORQUE / STIFFNESS
    numbers[field] += 1e-30j * there[field]
    wanted = ringing(**numbers).imag / 1e-30
    found = (near["output_angle"] - here["output_angle"]) / STEP
    assert np.max(np.abs(found - wanted)) < within * np.max(np.abs(wanted))


MOVES = {
    "kinematic_error": lambda f: {"components": [{"order": 2, "amplitude_arcmin": 0.5 * f}]},
    "motor_torque_ripple": lambda f: {"components": [{"order": 12, "cogging_nm": 0.03 * f}]},
    "lugre_friction": lambda f: {"coulomb_nm": 0.03 * f},
    "torsional_hysteresis_maxwell": lambda f: {"slip_torque_nm": 2.0 * f},
    "base_flexibility": lambda f: {"stiffness_nm_per_rad": 1.5e5 * f, "natural_frequency_hz": 60.0},
    "output_backlash": lambda f: {"backlash_arcmin": 0.5 * f},
    "sensors": lambda f: {"output_angle": {"delay_s": 0.0007 * f}},
}


@pytest.mark.parametrize("effect", MOVES)
def test_an_effect_changes_as_runs_of_its_own_say(effect):
    load = {"inertia_kg_m2": INERTIA, "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3}}
    swing = SignalData(Sine(amplitude=40.0, frequency_hz=1.5).move())

    def at(part):
        drive = {"preset": "csg-20-100", "mesh": {"model": "lumped"}}
        return model_of(drive, {effect: MOVES[effect](part)}, load, swing)

    other = at(1.0 + STEP)
    assert alike(at(1.0), other, TIMES[-1])
    here, near = samples_beside(at(1.0), [other], TIMES, CHANNELS, rtol=1e-7)
    back, ahead = (sample(at(part), TIMES, CHANNELS, rtol=1e-11) for part in (1.0 - WIDE, 1.0 + WIDE))
    told = 0
    for channel in here:
        wanted = (ahead[channel] - back[channel]) / (2.0 * WIDE)
        found = (near[channel] - here[channel]) / STEP
        if np.std(wanted) > 1e-6 * np.std(here[channel]):
            assert np.std(found - wanted) < 0.03 * np.std(wanted), channel
            told += 1
    assert told


def test_a_model_with_another_part_is_not_alike():
    plain, rippled = model_of(drive()), model_of(drive(), {"kinematic_error": {}})
    assert not alike(plain, rippled, TIMES[-1])
    assert alike(plain, model_of(drive(damping_nm_s_per_rad=7.0)), TIMES[-1])


def test_the_model_itself_is_what_it_is_alone():
    alone = sample(model_of(drive()), TIMES, CHANNELS)
    here, near = samples_beside(model_of(drive()), [model_of(drive())], TIMES, CHANNELS)
    for channel in CHANNELS:
        assert np.array_equal(alone[channel], here[channel])
        assert np.allclose(near[channel], here[channel], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("mesh", ["lumped", "teeth"])
def test_what_is_taken_from_the_model_is_what_it_would_be_computed_anew(mesh):
    swing = SignalData(Sine(amplitude=40.0, frequency_hz=1.5).move())

    def at(part, amplitude=0.5):
        effects = {"kinematic_error": {"components": [{"order": 2, "amplitude_arcmin": amplitude}]}}
        torsion = {"damping_nm_s_per_rad": DAMPING * part}
        drive = {"preset": "seed-2021", "mesh": {"model": mesh}, "torsion": torsion}
        return model_of(drive, effects, motion=swing)

    # Between two that take from the scratch one that fills it with its own.
    one, others = at(1.0), [at(1.0 + STEP), at(1.0, 0.5 * (1.0 + STEP)), at(1.0 - STEP)]
    given = _beside(one, others)
    assert given.shared.tolist() == [True, False, True]
    anew = replace(given, integers=given.integers.copy(), shared=np.zeros(3, dtype=np.bool_))
    anew.integers[:, layout.GIVEN] = 0
    system, times = one.system, TIMES[:100]
    near = []
    for beside in (given, anew):
        beside.reals[:, layout.INSIDE] = system.reals[layout.INSIDE] = 0.05
        found = rodas4_through(
            system, times[[0, -1]], system.y0, times, rtol=1e-6, atol=1e-6 * system.scale, others=beside
        )
        near.append(found.beside)
    assert np.max(np.abs(near[0])) > 0.0
    np.testing.assert_array_equal(near[0], near[1])
