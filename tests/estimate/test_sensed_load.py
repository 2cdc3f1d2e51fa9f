"""A torque sensor whose reading is the load has all of the scenario's load in that reading."""

from typing import Any

import numpy as np
import pytest
from moves import positioned
from noisy import noisy

import hdsim
from hdsim.errors import InputError
from hdsim.estimate.opening import bench_for
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

LOAD = {"inertia_kg_m2": 0.4, "gravity": {"mass_kg": 3.0, "centre_of_mass_m": 0.3}}
NOISE = {"motor_angle": 1e-7, "output_angle": 1e-7, "output_torque": 1e-3, "motor_torque": 1e-5}


def scenario(load: dict[str, Any], **command: Any) -> Scenario:
    """An arm that swings, or what is given."""
    swing = {"type": "sine", "amplitude_deg": 30.0, "frequency_hz": 0.8}
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "command": {**positioned(swing), **command},
        "load": load,
        "run": {"duration_s": 5.0, "sample_rate_hz": 500.0},
    })  # fmt: skip


@pytest.mark.parametrize("load", [LOAD, {"inertia_kg_m2": 1e-3}], ids=["the arm", "hardly anything"])
def test_what_the_scenario_says_of_the_load_is_not_counted_twice(load: dict[str, Any]) -> None:
    """The weight winds the spring up by 0.3 mrad, and is 44 mN m at the motor: it would be twice as much."""
    record = noisy(hdsim.simulate(scenario(LOAD)), NOISE, seed=0)
    base = scenario(load)
    bench = bench_for([record], [], base, "output_torque")
    residuals = bench.residuals(bench.predict(state_of(base)))
    # The run begins with a jump of the sine's velocity.
    left = {s.channel: float(np.std(rest[600:])) for s, rest in zip(bench.series, residuals, strict=True)}
    # 1 mN m of the sensor's noise at 16 kN m/rad are 6e-8 rad.
    assert left["output_angle"] < 3e-7
    assert left["motor_torque"] < 3e-3


def test_a_locked_output_has_no_load() -> None:
    record = noisy(hdsim.simulate(scenario(LOAD)), NOISE, seed=0)
    with pytest.raises(InputError, match=r"the output is locked.*leave load to the scenario"):
        bench_for([record], [], scenario(LOAD, output={"type": "locked"}), "output_torque")
