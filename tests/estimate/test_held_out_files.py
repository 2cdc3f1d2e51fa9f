"""What a held-out file has of its own: the angle at which it carries nothing, and a beginning."""

import numpy as np
import pytest
from noisy import noisy
from test_beginning import SCENARIO as SWINGING
from test_beginning import measured as swinging

import hdsim
from hdsim.estimate.beginning import beginnings
from hdsim.estimate.opening import bench_for
from hdsim.estimate.prove import gaps
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

NOISE = {"output_angle": 4e-6, "output_torque": 0.1}
LOCKED = {
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": {"motor": {"type": "locked"}},
    "load": {
        "inertia_kg_m2": 0.05,
        "torque": {"type": "triangle", "amplitude_nm": 52, "frequency_hz": 0.25},
    },
    "run": {"duration_s": 8.0, "sample_rate_hz": 200},
}


def twisted(seed: int) -> Record:
    """A drive whose motor is locked."""
    run = hdsim.simulate(Scenario.model_validate(LOCKED))
    return noisy(run, NOISE, seed=seed, name=f"draw {seed}")


@pytest.mark.parametrize("turned_rad", [0.0, 2e-4, -1.5e-4])
def test_a_held_out_locked_record_has_a_zero_of_its_own(turned_rad):
    """What is told of it before any model is known may be off: each model that is proved there finds it."""
    base = Scenario.model_validate(LOCKED)
    bench = bench_for([twisted(1)], [twisted(2)], base, None)
    training, held = bench.predictors
    state = state_of(base)
    bench.weigh(bench.residuals(bench.predict(state)))
    before, found = training.motor_angle.copy(), held.motor_angle.copy()
    held.turn(turned_rad * held.ratio)
    gap = gaps(bench, {"before": state, "refit": state, "after": state})[0]["output_torque"]
    # 2e-4 rad of wind-up are 3 to 5 N m, by the stiffness there: no torque's offset makes up for that.
    assert gap.after < 1.1 * NOISE["output_torque"]
    assert held.motor_angle == pytest.approx(found, abs=1e-5 * abs(held.ratio))
    assert training.motor_angle == pytest.approx(before, abs=0.0)


def test_the_vibration_with_which_a_held_out_file_begins_is_in_no_gap():
    """It begins in a motion whose history nobody knows; a tenth of it at most is left out."""
    bench = bench_for([swinging(5.0)], [swinging(0.0)], SWINGING, None)
    state = state_of(SWINGING)
    bench.weigh(bench.residuals(bench.predict(state)))
    found, predictions = gaps(bench, {"before": state, "refit": state, "after": state})
    assert list(bench.begins_s) == [1]
    assert [one.kind for one in beginnings(bench)] == ["beginning"]
    (rest,) = (
        r
        for s, r in zip(bench.series, bench.residuals(predictions["after"]), strict=True)
        if s.record == 1 and s.channel == "output_angle"
    )
    assert found["output_angle"].after < 0.3 * float(np.sqrt(np.mean(rest**2)))
