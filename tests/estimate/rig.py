"""A drive on a bench, integrated by SciPy from Newton's law: it shares nothing with the fitted model."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

import hdsim
from hdsim.estimate.records import Record
from hdsim.scenario.model import Scenario

RATE, RATIO, G = 500.0, -100.0, 9.80665
WAVE_GENERATOR, RING = 1.93e-5, 2e-5

#: The bench's model: its numbers are wrong by up to a third.
MODEL = """
name: rig
drive:
  rated_torque_nm: 52
  geometry: {flexspline_teeth: 200, circular_spline_teeth: 202}
  torsion: {stiffness_k1_nm_per_rad: 3.0e3, stiffness_k2_nm_per_rad: 3.0e3, stiffness_k3_nm_per_rad: 3.0e3,
            torque_t1_nm: 7, torque_t2_nm: 25, damping_nm_s_per_rad: 8.0}
  inertia: {motor_kg_m2: 5.0e-5, wave_generator_kg_m2: 1.93e-5, ring_kg_m2: 2.0e-5}
  friction: {coulomb_nm: 0.03, viscous_nm_s_per_rad: 3.5e-4}
  mesh: {model: lumped}
command:
  motor: {type: free}
load: {inertia_kg_m2: 2.0, gravity: {mass_kg: 4.0, centre_of_mass_m: 0.3}}
run: {duration_s: 1.0}
"""
#: What the bench really has, by path.
TRUTH = {
    "drive.torsion.stiffness_k1_nm_per_rad": 3.6e3,
    "drive.torsion.damping_nm_s_per_rad": 6.0,
    "drive.inertia.motor_kg_m2": 6.0e-5,
    "drive.friction.coulomb_nm": 0.04,
    "drive.friction.viscous_nm_s_per_rad": 3.0e-4,
    "load.inertia_kg_m2": 1.8,
    "load.gravity.mass_kg": 4.4,
}
NOISE = {"motor_angle": 2e-5, "motor_torque": 3e-3, "output_angle": 2e-6}


def model(tmp_path) -> Scenario:
    """The scenario that is to be fitted, written to ``rig.yaml``."""
    path = tmp_path / "rig.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return hdsim.load_scenario(path)


@cache
def exact(seconds: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """From rest, a swing with a shake near the resonance: times, and what sensors without noise read."""
    t = np.arange(round(seconds * RATE)) / RATE
    parts = ((35.0, 2 * np.pi * 0.4), (6.0, 2 * np.pi * 1.3), (0.35, 2 * np.pi * 6.0))

    def motion(at):
        swing = [
            sum(a * (1 - np.cos(w * at)) for a, w in parts),
            sum(a * w * np.sin(w * at) for a, w in parts),
            sum(a * w * w * np.cos(w * at) for a, w in parts),
        ]
        # It rises from standstill over a second, with a continuous acceleration.
        u = np.clip(at - 0.2, 0.0, 1.0)
        rise = (u**3 * (10 - 15 * u + 6 * u**2), 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u))
        return (
            rise[0] * swing[0],
            rise[1] * swing[0] + rise[0] * swing[1],
            rise[2] * swing[0] + 2 * rise[1] * swing[1] + rise[0] * swing[2],
        )

    stiffness, damping, rotor, coulomb, viscous, inertia, mass = TRUTH.values()

    def torque(angle, speed, output, output_speed):
        return stiffness * (angle / RATIO - output) + damping * (speed / RATIO - output_speed)

    def rates(at, y):
        angle, speed, _ = motion(at)
        gravity = mass * G * 0.3 * np.sin(y[0])
        return [y[1], (torque(angle, speed, *y) - gravity) / (inertia + RING)]

    found = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-12)
    angle, speed, acceleration = motion(t)
    friction = coulomb * np.tanh(speed / 0.5) + viscous * speed
    motor = (rotor + WAVE_GENERATOR) * acceleration + friction + torque(angle, speed, *found.y) / RATIO
    return t, {"motor_angle": angle, "motor_torque": motor, "output_angle": found.y[0]}


def record(seed: int, seconds: float = 6.0, *, torque_offset: float = 0.0, name: str = "rig") -> Record:
    """The swing, measured with noise."""
    t, ideal = exact(seconds)
    rng = np.random.default_rng(seed)
    clean = ideal | {"motor_torque": ideal["motor_torque"] + torque_offset}
    return Record(name, t.copy(), {c: v + NOISE[c] * rng.standard_normal(len(t)) for c, v in clean.items()})
