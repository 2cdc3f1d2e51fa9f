"""A diagnosis whose base has all its teeth: what is hidden from it is named, in the time of a coffee."""

import time

import pytest
from diagnose_bench import servo_with_arm
from noisy import noisy

import hdsim
from hdsim.diagnosis.workflow import diagnose

NOISE = {"motor_angle": 2e-5, "output_angle": 4e-6, "motor_torque": 6e-3}
SECONDS = 3.5


def drive(mesh, **effects):
    run = {"duration_s": SECONDS, "sample_rate_hz": 1000.0, "rtol": 1e-5}
    return servo_with_arm({"model": mesh}, effects, frequency_hz=0.5, **run)


def seen(plant):
    return noisy(hdsim.simulate(plant), NOISE, seed=0, name="swing")


@pytest.mark.slow
def test_hidden_friction_is_named_against_all_teeth():
    record = seen(drive("teeth", stribeck_friction={"extra_static_nm": 0.08}))
    began = time.process_time()
    verdict = diagnose([record], drive("teeth")).verdict
    spent = time.process_time() - began
    assert verdict.effects[0].name == "stribeck_friction"
    gap = verdict.gap["motor_torque"]
    assert gap.after < min(gap.before, 1.3 * gap.noise)
    assert verdict.short_cut.taken
    assert max(verdict.short_cut.error.values()) < 0.03
    assert spent < 60.0


@pytest.mark.slow
def test_nothing_is_named_where_teeth_are_all_there_is():
    verdict = diagnose([seen(drive("teeth"))], drive("tabulated")).verdict
    assert verdict.verdict == "nothing"
    gap = verdict.gap["output_angle"]
    # The base's own teeth are the plant's: nothing but noise is left from the start.
    assert gap.before < 1.1 * gap.noise


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.study)])
def test_a_loop_is_named_beside_a_rest_before_another_effect_is_sought(seed):
    """The drive holds at its reversals. Seen before that was heard: Duhem's law, then others beside it."""
    run = {"sample_rate_hz": 1000.0}
    plant = servo_with_arm({"model": "teeth"}, {"torsional_hysteresis_maxwell": {}}, **run)
    record = noisy(hdsim.simulate(plant), NOISE, seed=seed)
    steps = []
    base = servo_with_arm({"model": "tabulated"}, {}, **run)
    verdict = diagnose([record], base, on_step=steps.append).verdict
    (named,) = verdict.effects
    assert named.name == "torsional_hysteresis_maxwell"
    assert named.settings["slip_torque_nm"] == pytest.approx(2.0, rel=0.05)
    gap = verdict.gap["output_angle"]
    assert gap.before > 10.0 * gap.noise
    assert gap.after < 1.05 * gap.noise
    # The law explains all once rests do not count: there is nothing more to screen.
    assert steps.count("screening the catalogue") == 1
    assert "testing each effect again beside the others" not in steps
