"""A hysteresis that has its name, in the formula of its own loop where the data tell it, and only there."""

from dataclasses import replace
from typing import Any

import pytest
from diagnose_bench import beyond, with_effects
from moves import positioned
from noisy import noisy

import hdsim
from hdsim.diagnosis.finer import refined
from hdsim.diagnosis.starts import starts
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

DUHEM = "torsional_hysteresis_duhem"
NOISE = {"motor_angle": 1e-5, "output_angle": 1e-6, "output_torque": 0.05}


def scenario(effects: dict[str, Any]) -> Scenario:
    """Loads that swell and ebb twist a drive that turns slowly: loops in loops."""
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "effects": effects,
        "command": positioned({"type": "sine", "amplitude_deg": 2.0, "frequency_hz": 0.1}),
        "load": {
            "inertia_kg_m2": 0.05,
            "torque": {
                "type": "multisine",
                "amplitude_nm": 30.0,
                "frequencies_hz": [0.25, 0.6],
                "phases_deg": [0.0, 0.0],
            },
        },
        "run": {"duration_s": 12.0, "sample_rate_hz": 200.0},
    })  # fmt: skip


def with_plain(truth: dict[str, float]) -> tuple[Bench, Fit, Fit]:
    """A log of a drive, the base re-fitted to it, and that with the effect in its plain formula."""
    base = scenario({})
    record = noisy(hdsim.simulate(scenario({DUHEM: truth})), NOISE, seed=0)
    bench = bench_for([record], [], base, "output_torque")
    found = refit(bench, state_of(base)).fit
    added, *_ = starts(DUHEM, catalogue()[DUHEM].fittings[0], (), bench.ranges(found.state))
    return bench, found, with_effects(bench, found, replace(added, coefficients=(2.0,)))


@pytest.mark.slow
def test_how_suddenly_a_branch_saturates_is_found_again() -> None:
    truth = {"saturation_torque_nm": 3.0, "saturation_twist_mrad": 0.3, "exponent": 2.5}
    bench, base, plain = with_plain(truth)
    found = together(bench, refined(bench, base, plain, lambda _: None))
    assert beyond(bench, plain) > 0.1
    assert beyond(bench, found) < 0.02
    own = found.state.added[0].settings()
    for field, value in truth.items():
        assert own[field] == pytest.approx(value, rel=0.1)


@pytest.mark.slow
def test_an_exponential_branch_stays_as_it_is() -> None:
    bench, base, plain = with_plain({"saturation_torque_nm": 3.0, "saturation_twist_mrad": 0.3})
    assert beyond(bench, plain) < 0.05
    assert refined(bench, base, plain, lambda _: None) is plain
