"""Small studies for the tests of the engine: a rigid drive whose transmission error is what is planted."""

from __future__ import annotations

import math
from typing import Any

from hdsim.studies.engine.definition import Base, Study

#: One motor turn in 0.2 s; with order 2 the transmission error is A sin(2 theta), peak to peak 2 A.
SCENARIO: dict[str, Any] = {
    "name": "planted",
    "drive": {"preset": "seed-2021", "mesh": {"model": "rigid"}},
    "effects": {"kinematic_error": {"components": [{"order": 2, "amplitude_arcmin": 0.5}]}},
    "command": {"motor": {"type": "motion", "trajectory": {"type": "ramp", "velocity_rpm": 300}}},
    "load": {"inertia_kg_m2": 0.05},
    "run": {
        "duration_s": 0.2,
        "sample_rate_hz": 2000,
        "start": {"motor_velocity_rad_per_s": 10 * math.pi},
    },
}
AMPLITUDE = "effects.kinematic_error.components[0].amplitude_arcmin"
METRIC = "transmission_error_peak_to_peak"

#: A drive with teeth that turns a little: every seed gives another result, and a run takes a while.
TOOTHED: dict[str, Any] = {
    **SCENARIO,
    "name": "toothed",
    "drive": {"preset": "seed-2021"},
    "run": {"duration_s": 0.05, "sample_rate_hz": 2000, "teeth_rate_hz": 0},
    "load": {"inertia_kg_m2": 0.05, "torque": {"type": "hold", "torque_nm": 5}},
}


def study(scenario: dict[str, Any] | None = None, **given: Any) -> Study:
    fields = {"name": "test", "base": {"scenario": scenario or SCENARIO}, "metrics": [METRIC]}
    return Study.model_validate(fields | given)


__all__ = ["AMPLITUDE", "METRIC", "SCENARIO", "TOOTHED", "Base", "study"]
