"""A first effect beside a missing second one bends the base: nothing is left that looks like the second."""

from collections.abc import Callable

import numpy as np
import pytest
from diagnose_bench import bent
from moves import NOISE, positioned, to_and_fro
from noisy import noisy

import hdsim
from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.locate import locate
from hdsim.diagnosis.name import name_effect
from hdsim.diagnosis.passes import Search, Stage
from hdsim.diagnosis.search import _one_more
from hdsim.diagnosis.traces import screen
from hdsim.estimate.fit import sharpened
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

#: The output encoder reads so much late, s.
DELAY_S = 8e-4
#: Factors on the base's numbers, about as large as a missing delay made them in a calibration case.
BENT = {
    "drive.torsion.stiffness_k1_nm_per_rad": 0.3,
    "drive.torsion.damping_nm_s_per_rad": 15.0,
    "drive.inertia.motor_kg_m2": 1.5,
}


def joint(load_side_friction: dict[str, float]) -> Scenario:
    effects = {"load_side_friction": load_side_friction} if load_side_friction else {}
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "effects": effects,
        "command": positioned(to_and_fro((60, -90, 45), 90, 500, 8000)),
        "load": {"inertia_kg_m2": 0.4},
        "run": {"duration_s": 5.0, "sample_rate_hz": 333.0},
    })  # fmt: skip


@pytest.mark.slow
def test_a_second_effect_is_asked_for_over_the_base_as_given() -> None:
    run = hdsim.simulate(joint({"coulomb_nm": 8.0, "viscous_nm_s_per_rad": 2.0}))
    record = noisy(run, NOISE | {"output_torque": 0.05}, seed=1)
    late = np.interp(record.time - DELAY_S, record.time, run["output_angle"])
    record.channels["output_angle"] = late + record.channels["output_angle"] - run["output_angle"]
    base = joint({})
    bench = bench_for([record], [], base, None)
    begun = refit(bench, state_of(base)).fit
    left = left_of(bench, begun)
    first = name_effect(bench, begun, screen(bench, begun.state, left, []), left)
    assert first is not None
    assert first.name == "load_side_friction"

    current = sharpened(bench, bent(bench, first.fit, BENT))
    assert bench.power(current.predictions) > 3.0 * bench.noise_power
    found = Search(current, left_of(bench, current), named=[first])
    location = locate(
        bench, found.left, bench.residuals(current.predictions, drift=True), current.state.delays
    )
    stage = Stage("with load_side_friction", location, found.left.power)
    found.stages.append(stage)

    def during(step: str, what: str) -> Callable[[str], object]:
        return lambda detail: None

    second = _one_more(bench, begun, current, found, stage, False, during, {})
    assert second is not None
    assert second.name == "sensors"
    assert second.fit.state.added[-1].settings()["output_angle"]["delay_s"] == pytest.approx(DELAY_S, rel=0.1)
