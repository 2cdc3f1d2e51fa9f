"""Compile what nearly every test needs, before processes side by side would each compile it."""

from __future__ import annotations

import hdsim
from hdsim.scenario import Scenario

for mesh in ("rigid", "lumped", "tabulated", "teeth"):
    hdsim.simulate(
        Scenario.model_validate({
            "drive": {"preset": "seed-2021", "mesh": {"model": mesh}},
            "effects": {"set": "catalogue"},
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
            "run": {"duration_s": 0.002, "sample_rate_hz": 1000},
        })
    )  # fmt: skip
