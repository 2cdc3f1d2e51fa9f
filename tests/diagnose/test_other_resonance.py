"""A base whose spring is far off has its resonance elsewhere; what drives it is named all the same."""

from typing import Any

import numpy as np
import pytest
from diagnose_bench import with_stiffness
from moves import NOISE, positioned, to_and_fro
from noisy import noisy

import hdsim
from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.name import name_effect
from hdsim.diagnosis.remembered import remembered
from hdsim.diagnosis.screen import Residual
from hdsim.diagnosis.traces import Screening, screen
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present
from hdsim.estimate.numbers import scaled
from hdsim.estimate.opening import bench_for
from hdsim.estimate.orders import lines_of
from hdsim.estimate.refit import refit
from hdsim.estimate.state import State, state_of
from hdsim.scenario import Scenario

#: Stiffness K1 of the preset, N m/rad; with the load it rings at 14 Hz, and the motor makes up to 20 turns a
#: second: a quarter of it rings at 7 Hz, which an error twice a turn crosses as well, at half the speed.
K1 = 1.6e4
AMPLITUDE_ARCMIN = 2.0


def joint(effects: dict[str, Any]) -> Scenario:
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "effects": effects,
        "command": positioned(to_and_fro((60, -90, 45), 70, 60, 600), position_gain_per_s=10.0),
        "load": {"inertia_kg_m2": 2.0},
        "run": {"duration_s": 7.0, "sample_rate_hz": 250.0},
    })  # fmt: skip


def opened(times: float) -> tuple[Bench, Fit]:
    """A record with an error twice a turn, and the re-fit of a base with a part of the drive's stiffness."""
    component = {"order": 2, "amplitude_arcmin": AMPLITUDE_ARCMIN, "phase_deg": 30}
    run = hdsim.simulate(joint({"kinematic_error": {"components": [component]}}))
    base = with_stiffness(joint({}), times)
    bench = bench_for([noisy(run, NOISE, seed=1)], [], base, None)
    return bench, refit(bench, state_of(base)).fit


Quarter = tuple[Bench, Fit, Residual, Screening]


@pytest.fixture(scope="module")
def quarter() -> Quarter:
    """From a quarter of the stiffness: record, re-fit, what that leaves, and the catalogue on the screen."""
    bench, base = opened(0.25)
    left = left_of(bench, base)
    lines = lines_of(bench, bench.residuals(base.predictions, drift=True), base.state.delays)
    return bench, base, left, screen(bench, base.state, left, lines)


@pytest.mark.slow
def test_an_error_that_crosses_the_resonance_is_named_from_a_quarter_of_the_stiffness(
    quarter: Quarter,
) -> None:
    """Otherwise it is a damaged tooth, 30 degrees wide, beside 0.57 of the stiffness."""
    bench, base, left, screening = quarter
    named = name_effect(bench, base, screening, left)
    assert named is not None
    assert named.name == "kinematic_error"
    numbers = {free.name: free.at(t) for free, t in zip(named.fit.frees, named.fit.theta, strict=True)}
    assert numbers["drive.torsion.stiffness_k1_nm_per_rad"] == pytest.approx(K1, rel=0.1)


@pytest.mark.slow
def test_of_what_the_noise_may_have_left_no_more_than_all_is_explained(
    quarter: Quarter, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, base, left, screening = quarter
    loud = 2.0 * bench.power(base.predictions)
    monkeypatch.setattr(Bench, "noise_power", property(lambda _: loud))
    named = name_effect(bench, base, screening, left)
    assert named is not None
    assert max(one.explained for one in named.candidates) == pytest.approx(1.0)
    assert all(one.explained <= 1.0 for one in named.candidates)


@pytest.mark.slow
def test_only_traces_that_the_spring_changes_are_made_anew(quarter: Quarter) -> None:
    bench, base, _, screening = quarter
    springs = [free for free in at_present(base) if free.compliance]
    stiff = scaled(base.state, springs, [np.log(3.0)] * len(springs))
    asked = {added.effect for added, _ in screening.seen.values()}

    def changed_in(state: State) -> set[str]:
        with bench.coarse():
            kept = remembered(bench, screening, state, bench.predict(state), screening.sigmas)
        return asked - {added.effect for added, _ in kept.values()}

    changed = changed_in(stiff)
    assert changed_in(base.state) == set()
    assert {"wave_generator_eccentricity", "damaged_tooth"} <= changed
    # What the motor alone feels, whose motion is measured, is the same with any spring.
    assert {"stribeck_friction", "thermal_friction", "load_dependent_loss"} <= asked
    assert not {"stribeck_friction", "motor_torque_ripple", "thermal_friction"} & changed
