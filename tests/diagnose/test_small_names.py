"""Effects of some arcseconds are named from records that show them, and not from those that do not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from diagnose_bench import motion, rigid_record, scenario

from hdsim.diagnosis.workflow import diagnose
from hdsim.effects import catalogue
from hdsim.estimate.predict import Predictor, plan_for
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of

NOISE = {"output_angle": 5e-6, "motor_torque": 2e-3}


def hidden(base: Any, effects: dict[str, Any], seconds: float = 5.0, **given: np.ndarray) -> Record:
    """What the base's drive with more effects shows of a swing, with noise."""
    t, angle, _, _ = motion(seconds)
    rng = np.random.default_rng(3)
    motions = {"motor_angle": angle} | given
    blank = {channel: rng.standard_normal(len(t)) for channel in NOISE}
    record = Record("hidden", t, motions | blank)
    state = state_of(base)
    built = {name: catalogue()[name].model_validate(values) for name, values in effects.items()}
    state = replace(state, effects=state.effects | built)
    seen = Predictor(record, plan_for(record), base.drive.ratio).predict(state.candidate())
    noisy = {channel: seen[channel] + NOISE[channel] * rng.standard_normal(len(t)) for channel in NOISE}
    return Record("hidden", t, motions | noisy)


def varying_load(seconds: float = 5.0) -> np.ndarray:
    t = motion(seconds)[0]
    return np.asarray(18 * np.sin(2 * np.pi * 0.21 * t) + 6 * np.sin(2 * np.pi * 0.53 * t))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "component"),
    [
        ("load_dependent_kinematic_error", {"order": 2, "stiffness_nm_per_rad": 1000.0, "phase_deg": 30.0}),
        pytest.param(
            "kinematic_error",
            {"order": 2, "amplitude_arcmin": 0.2, "phase_deg": 30.0},
            marks=pytest.mark.study,
        ),
    ],
)
def test_an_error_that_grows_with_the_load_is_told_from_one_that_does_not(tmp_path, name, component):
    base = scenario(tmp_path, "lumped")
    record = hidden(base, {name: {"components": [component]}}, load_torque=varying_load())
    (found,) = diagnose([record], base).verdict.effects
    assert found.name == name
    assert found.indistinguishable_from == []
    (amplitude,) = (key for key in component if key.startswith(("stiffness", "amplitude")))
    for field in (amplitude, "phase_deg"):
        assert found.parameters[f"components.0.{field}"].value == pytest.approx(component[field], rel=0.05)


@pytest.mark.parametrize("name", ["position_dependent_friction", "motor_torque_ripple"])
def test_friction_over_the_angle_is_told_from_a_ripple_by_turning_round(tmp_path, name):
    def lumpy(angle, velocity):
        sign = np.tanh(velocity / 0.5) if name == "position_dependent_friction" else 1.0
        return 0.006 * np.sin(2 * angle + 0.4) * sign

    (found,) = diagnose([rigid_record(extra=lumpy, seed=2)], scenario(tmp_path)).verdict.effects
    assert found.name == name
    assert "position_dependent_friction" not in found.indistinguishable_from


@pytest.mark.slow
def test_a_stiffness_that_falls_with_the_measured_temperature_is_named(tmp_path):
    base = scenario(tmp_path, "lumped")
    load = varying_load()
    warmer = 20.0 + 30.0 * np.linspace(0.0, 1.0, len(load))
    softer = {"thermal_stiffness": {"stiffness_coefficient_per_k": 2e-3}}
    record = hidden(base, softer, load_torque=load, temperature=warmer)
    (found,) = diagnose([record], base).verdict.effects
    assert found.name == "thermal_stiffness"
    assert found.indistinguishable_from == []
    assert found.parameters["stiffness_coefficient_per_k"].value == pytest.approx(2e-3, rel=0.05)


def test_a_larger_ball_is_told_from_friction_of_the_wave_generators_own_orders(tmp_path):
    def larger(angle, velocity):
        return 0.006 * (1 + np.sin(1.088 * angle * 1.01 + 0.4)) * np.tanh(velocity / 0.5)

    (found,) = diagnose([rigid_record(12.0, extra=larger, seed=2)], scenario(tmp_path)).verdict.effects
    assert found.name == "wave_generator_bearing"
    assert found.parameters["ball_to_pitch_diameter"].value == pytest.approx(0.088, abs=2e-3)
    assert found.parameters["components.0.friction_nm"].value == pytest.approx(0.006, rel=0.05)
