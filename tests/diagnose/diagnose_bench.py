"""Records with known content for the tests of the diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

import hdsim
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present, fit
from hdsim.estimate.numbers import scaled
from hdsim.estimate.records import Record
from hdsim.estimate.refit import together
from hdsim.estimate.state import Added
from hdsim.scenario.model import Scenario

RATE = 500.0

BASE = """
name: bench
drive:
  rated_torque_nm: 52
  geometry: {flexspline_teeth: 200, circular_spline_teeth: 202}
  torsion: {stiffness_k1_nm_per_rad: 1.6e4, stiffness_k2_nm_per_rad: 2.5e4, stiffness_k3_nm_per_rad: 2.9e4,
            torque_t1_nm: 7, torque_t2_nm: 25, damping_nm_s_per_rad: 8.0}
  inertia: {motor_kg_m2: 5.0e-5, wave_generator_kg_m2: 1.93e-5}
  friction: {coulomb_nm: 0.03, viscous_nm_s_per_rad: 3.5e-4}
  mesh: {model: MESH}
command:
  motor: {type: free}
load: {inertia_kg_m2: 0.5}
run: {duration_s: 1.0}
"""


def scenario(tmp_path, mesh: str = "rigid", **changes) -> Scenario:
    """The bench's model, its drive's sections changed."""
    path = tmp_path / f"{mesh}.yaml"
    path.write_text(BASE.replace("MESH", mesh), encoding="utf-8")
    loaded = hdsim.load_scenario(path)
    for section, values in changes.items():
        part = getattr(loaded.drive, section).model_copy(update=values)
        loaded = loaded.model_copy(update={"drive": loaded.drive.model_copy(update={section: part})})
    return loaded


def servo_with_arm(
    mesh: Mapping[str, Any], effects: Mapping[str, Any], *, frequency_hz: float = 0.25, **run: float
) -> Scenario:
    """The seed drive with an arm that a position loop swings to and fro."""
    return Scenario.model_validate({
        "drive": {"preset": "seed-2021", "mesh": mesh},
        "effects": effects,
        "command": {"motor": {
            "type": "position",
            "at": "output",
            "trajectory": {"type": "sine", "amplitude_deg": 30.0, "frequency_hz": frequency_hz},
            "controller": {
                "type": "cascade",
                "position_gain_per_s": 30,
                "velocity_gain_nm_s_per_rad": 0.025,
                "velocity_integral_gain_nm_per_rad": 0.5,
            },
        }},
        "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3}},
        "run": {"duration_s": 8.0, "sample_rate_hz": 250.0} | run,
    })  # fmt: skip


def motion(seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Time, motor angle, velocity and acceleration of a swing that is exactly differentiable."""
    t = np.arange(round(seconds * RATE)) / RATE
    parts = ((60.0, 2 * np.pi * 0.3), (8.0, 2 * np.pi * 1.1))
    angle = sum(a * (1 - np.cos(w * t)) for a, w in parts)
    velocity = sum(a * w * np.sin(w * t) for a, w in parts)
    acceleration = sum(a * w * w * np.cos(w * t) for a, w in parts)
    return t, np.asarray(angle), np.asarray(velocity), np.asarray(acceleration)


def rigid_record(
    seconds: float = 8.0,
    *,
    inertia: float = 6.93e-5 + 0.50002 / 1e4,
    coulomb: float = 0.03,
    viscous: float = 3.5e-4,
    extra=lambda angle, velocity: 0.0,
    noise: float = 2e-3,
    seed: int = 0,
) -> Record:
    """What Newton's law gives for the rigid drive: torque of the swing, friction, something hidden."""
    t, angle, velocity, acceleration = motion(seconds)
    rng = np.random.default_rng(seed)
    torque = inertia * acceleration + coulomb * np.tanh(velocity / 0.5) + viscous * velocity
    torque = torque + extra(angle, velocity) + noise * rng.standard_normal(len(t))
    return Record("bench", t, {"motor_angle": angle, "motor_torque": torque})


def with_effects(bench: Bench, found: Fit, *added: Added) -> Fit:
    """A re-fitted model with effects, all its numbers fitted together."""
    state = replace(found.state, added=added)
    one = fit(bench, state, at_present(found), prune=False, after=found, evaluations=20, rough=True)
    return together(bench, one, rough=True)


def bent(bench: Bench, found: Fit, factors: Mapping[str, float]) -> Fit:
    """A fit with parameters, by their paths, that many times as large."""
    frees = at_present(found)
    theta = np.array([np.log(factors.get(free.name, 1.0)) for free in frees])
    state = scaled(found.state, frees, theta.tolist())
    return replace(found, state=state, frees=frees, theta=theta, predictions=bench.predict(state))


def with_stiffness(scenario: Scenario, times: float) -> Scenario:
    """A scenario whose drive's spring is that many times as stiff in all its sections."""
    names = ("stiffness_k1_nm_per_rad", "stiffness_k2_nm_per_rad", "stiffness_k3_nm_per_rad")
    torsion = scenario.drive.torsion
    torsion = torsion.model_copy(update={name: times * getattr(torsion, name) for name in names})
    return scenario.model_copy(update={"drive": scenario.drive.model_copy(update={"torsion": torsion})})


def beyond(bench: Bench, found: Fit) -> float:
    """Power of what a model leaves beyond the noise, over that of the noise."""
    return bench.power(found.predictions) / bench.noise_power - 1.0
