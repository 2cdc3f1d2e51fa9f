"""Where a prediction begins: under the load that was measured first."""

import numpy as np

from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

TIME = np.arange(0.0, 3.0, 0.002)


def base(**load) -> Scenario:
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "command": {"motor": {"type": "free"}},
        "load": {"inertia_kg_m2": 1.0} | load,
        "run": {"duration_s": 1.0},
    })  # fmt: skip


def still(**more: np.ndarray) -> Record:
    """A joint that stands, as three sensors read it."""
    rng = np.random.default_rng(1)
    noise = {"motor_angle": 1e-5, "output_angle": 1e-6, "motor_torque": 1e-3}
    return Record("still", TIME, {c: s * rng.standard_normal(len(TIME)) for c, s in noise.items()} | more)


def output_angle(record: Record, scenario: Scenario) -> np.ndarray:
    bench = bench_for([record], [], scenario, None)
    predicted = dict(zip((s.channel for s in bench.series), bench.predict(state_of(scenario)), strict=True))
    return predicted["output_angle"]


def test_a_load_that_rises_from_nothing_has_not_been_there_before():
    """Led in at its first slope a ramp of 40 N m/s would begin half a second early, with 20 N m."""
    load = 40.0 * np.clip(TIME, 0.0, 0.5) + 0.05 * np.random.default_rng(2).standard_normal(len(TIME))
    angle = output_angle(still(load_torque=load), base())
    assert np.abs(angle[:10]).max() < 0.1 * np.abs(angle[-1])
