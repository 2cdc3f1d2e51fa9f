"""A prediction begins in the balance that its record begins with."""

import numpy as np
import pytest

from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario
from hdsim.simulation.operating_point import find_operating_point

NOISE = {"motor_angle": 1e-5, "output_angle": 1e-6, "motor_torque": 1e-3}


def held(effects=(), mesh="lumped", inertia_kg_m2=1.0):
    """An arm that the motor holds level."""
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": mesh}},
        "effects": {name: {} for name in effects},
        "command": {"motor": {"type": "free"}},
        "load": {
            "inertia_kg_m2": inertia_kg_m2,
            "gravity": {"mass_kg": 5.0, "centre_of_mass_m": 0.4, "hanging_angle_deg": 90.0},
        },
        "run": {"duration_s": 1.0},
    })  # fmt: skip


@pytest.mark.parametrize(
    ("effects", "mesh", "inertia_kg_m2"),
    [
        ((), "lumped", 1.0),
        ((), "lumped", 4.0),
        ((), "lumped", 0.2),
        (("output_backlash",), "lumped", 1.0),
        ((), "tabulated", 1.0),
    ],
)
def test_an_arm_that_is_held_does_not_swing(effects, mesh, inertia_kg_m2):
    base = held(effects, mesh, inertia_kg_m2)
    time = np.arange(1000) / 500.0
    rng = np.random.default_rng(0)
    record = Record("held", time, {c: size * rng.standard_normal(len(time)) for c, size in NOISE.items()})
    bench = bench_for([record], [], base)
    angles = next(
        p
        for s, p in zip(bench.series, bench.predict(state_of(base)), strict=True)
        if s.channel == "output_angle"
    )
    # The motor's noise moves the prescribed motion, and the output with it.
    assert np.ptp(angles) < 0.2 * NOISE["output_angle"]
    if mesh == "lumped":
        balance = find_operating_point(base).outputs["output_angle"]
        assert np.mean(angles) - np.mean(bench.predictors[0].motor_angle) / bench.predictors[
            0
        ].ratio == pytest.approx(balance, abs=0.2 * NOISE["output_angle"])
