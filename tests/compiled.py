"""Compile what nearly every test needs, before processes side by side would each compile it."""

from __future__ import annotations

from noisy import noisy

import hdsim
from hdsim.scenario import Scenario


def scenario(mesh: str, seconds: float, effects: str) -> Scenario:
    return Scenario.model_validate({
        "drive": {"preset": "seed-2021", "mesh": {"model": mesh}},
        "effects": {"set": effects} if effects else {},
        "command": {
            "motor": {
                "type": "position",
                "trajectory": {"type": "sine", "amplitude_deg": 20, "frequency_hz": 2},
                "controller": {
                    "type": "cascade",
                    "position_gain_per_s": 40,
                    "velocity_gain_nm_s_per_rad": 0.025,
                    "velocity_integral_gain_nm_per_rad": 0.5,
                },
            }
        },
        "load": {"inertia_kg_m2": 0.5},
        "run": {"duration_s": seconds, "sample_rate_hz": 500},
    })  # fmt: skip


for mesh in ("rigid", "lumped", "tabulated", "teeth"):
    hdsim.simulate(scenario(mesh, 0.01, "catalogue"))
drive = scenario("lumped", 3.0, "")
noise = {"motor_angle": 1e-5, "output_angle": 1e-6, "motor_torque": 1e-3}
swing = noisy(hdsim.simulate(drive), noise, seed=0, name="swing")
hdsim.fit([swing], drive, free=["drive.friction.coulomb_nm"])
