"""The mean half-gap of a drive whose flanks nobody knows: its interval holds what other wear would have."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import hdsim
from hdsim.diagnosis.half_gap import _imputed, half_gap_ends, half_gap_with, own_half_gap
from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.flanks import widen_by_flanks
from hdsim.estimate.opening import bench_for
from hdsim.estimate.records import Record
from hdsim.estimate.refit import refit, together
from hdsim.estimate.state import Added, state_of
from hdsim.estimate.write import fitted_numbers
from hdsim.scenario import Scenario

NOISE = {"motor_angle": 1e-5, "output_angle": 1e-6, "motor_torque": 2e-3, "load_torque": 1e-3}
GROWTH = 1.0


def scenario(effects: dict[str, Any], seed: int, model: str = "tabulated") -> Scenario:
    return Scenario.model_validate({
        "drive": {
            "preset": "seed-2021",
            "mesh": {"model": model, "ring": "static"},
            "torsion": {"damping_nm_s_per_rad": 40.0},
        },
        "effects": effects,
        "command": {
            "motor": {
                "type": "motion",
                "trajectory": {"type": "sine", "amplitude_deg": 800, "frequency_hz": 0.5},
            }
        },
        "load": {
            "inertia_kg_m2": 0.5,
            "torque": {"type": "sine", "amplitude_nm": 45, "frequency_hz": 1.3},
        },
        "run": {"duration_s": 2.6, "sample_rate_hz": 250, "teeth_rate_hz": 0, "seed": seed},
    })  # fmt: skip


@cache
def fitted(effect: str) -> tuple[Bench, Fit, float]:
    """A plant with other flanks, each gap grown in proportion to itself; a base with an effect; the truth."""
    plant = scenario({"flank_wear": {"growth": GROWTH}}, 11, "teeth")
    run, rng = hdsim.simulate(plant), np.random.default_rng(0)
    late = run.time >= 0.6 - 1e-9
    time = run.time[late] - 0.6
    channels = {c: run[c][late] + s * rng.standard_normal(len(time)) for c, s in NOISE.items()}
    bench = bench_for([Record("r", time, channels)], [], scenario({}, 4), "load_torque")
    base = refit(bench, state_of(scenario({}, 4))).fit
    fitting = catalogue()[effect].fittings[0]
    state = replace(base.state, added=(Added(effect, fitting, (1.0,)),))
    return bench, together(bench, base, state), (1.0 + GROWTH) * own_half_gap(state_of(plant))


@pytest.mark.slow
@pytest.mark.parametrize("effect", [pytest.param("output_backlash", marks=pytest.mark.study), "flank_wear"])
def test_its_interval_holds_the_gap_of_other_flanks_that_wore_otherwise(effect: str) -> None:
    bench, found, true = fitted(effect)
    (added,) = found.state.added
    of = catalogue()[effect].of_teeth
    assert of is not None
    at = found.numbers_of(0)
    numbers = fitted_numbers(added, found.covariance[at, at], np.zeros(0))
    value = numbers[of.field].value
    ends = half_gap_ends(bench, found, effect, of, value)
    assert ends is not None
    low, high = ends
    assert low < true < high
    assert low < half_gap_with(of, found.state, value) < high
    assert high - low < 0.6 * true, "it still tells something"
    assert low > own_half_gap(found.state), "and that the gaps have grown"
    if effect == "output_backlash":
        interval = numbers[of.field].interval
        assert interval is not None
        assert half_gap_with(of, found.state, interval[1]) < true, "that of the effect alone does not"


@pytest.mark.slow
def test_other_flanks_widen_a_fit_by_what_they_move_it() -> None:
    bench, found, _ = fitted("output_backlash")
    before = np.diag(found.covariance).copy()
    widen_by_flanks(bench, found)
    after = np.diag(found.covariance)
    assert np.all(after >= before)
    assert after[-1] > 1.1 * before[-1]


@pytest.mark.parametrize("within", [0.0, 1.0])
def test_imputations_hold_one_more_drive_as_often_as_they_say(within: float) -> None:
    # What one more drive tells, with the scatter of a fit: a draw of the same two spreads.
    rng, trials, held = np.random.default_rng(3), 4000, 0
    for _ in range(trials):
        told = 10.0 + 2.0 * rng.standard_normal(9)
        true = 10.0 + 2.0 * rng.standard_normal() + within * rng.standard_normal()
        low, high = _imputed(told, (within * 1.96 / 2.0) ** 2)
        held += low < true < high
    assert abs(held / trials - 0.95) < 3 * np.sqrt(0.95 * 0.05 / trials) + 0.005 * within
