"""A load that is free in its play bounces, and bounces part: a fit that stops there says so."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from moves import positioned
from noisy import noisy

import hdsim
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.estimate.unsettled import unsettled
from hdsim.scenario import Scenario

SWEEP = {
    "type": "chirp", "amplitude_deg": 8.0,
    "start_frequency_hz": 0.3, "end_frequency_hz": 2.0, "duration_s": 6.0,
}  # fmt: skip
NOISE = {"motor_angle": 3e-6, "output_angle": 1e-6, "motor_torque": 3e-3}


def drive(play_arcmin: float, load_kg_m2: float) -> Scenario:
    """A heavy load behind a spring with little damping."""
    section: dict[str, Any] = {
        "drive": {
            "preset": "csg-20-100",
            "mesh": {"model": "lumped"},
            "torsion": {"damping_nm_s_per_rad": 2.0},
        },
        "command": positioned(SWEEP),
        "load": {"inertia_kg_m2": load_kg_m2},
        "run": {"duration_s": 6.0, "sample_rate_hz": 250.0},
    }
    if play_arcmin:
        section["effects"] = {"output_backlash": {"backlash_arcmin": play_arcmin}}
    return Scenario.model_validate(section)


def problems_of(play_arcmin: float, load_kg_m2: float, seed: int) -> list[Problem]:
    """What is said of the fit of a record of this very drive that begins with another load."""
    record = noisy(hdsim.simulate(drive(play_arcmin, 3.0)), NOISE, seed=seed)
    base = drive(play_arcmin, load_kg_m2)
    bench = bench_for([record], [], base)
    return unsettled(bench, refit(bench, state_of(base)).fit)


@pytest.mark.slow
@pytest.mark.study
def test_a_fit_that_a_free_load_has_stopped_is_said():
    # Where it stops is chance: six of eight are said.
    said = [problems_of(0.5, *begin) for begin in ((3.3, 1), (3.3, 2), (3.45, 2), (2.7, 1))]
    assert any(said)
    problem = next(each[0] for each in said if each)
    assert (problem.channel, problem.kind, problem.severity) == ("model", "unsettled", "warning")


@pytest.mark.slow
@pytest.mark.parametrize("load_kg_m2", [2.7, 3.45])
def test_without_play_it_comes_to_rest(load_kg_m2):
    assert not problems_of(0.0, load_kg_m2, seed=1)


@pytest.mark.parametrize(("promised", "said"), [(2.9, False), (12.0, True)])
@pytest.mark.parametrize("play_arcmin", [0.0, 0.5])
def test_it_is_said_from_a_standard_error_of_each_number_on(promised, said, play_arcmin):
    bench = SimpleNamespace(predictors=[SimpleNamespace(record=SimpleNamespace(name="sweep"))])
    state = state_of(drive(play_arcmin, 3.0))
    found = unsettled(bench, SimpleNamespace(columns=np.zeros((100, 3)), promised=promised, state=state))
    assert bool(found) == said
    if said:
        assert found[0].record == "sweep"
        assert "by 2 standard errors" in found[0].message
        # A load is free only where there is something to be free in.
        assert ("free in a play" in found[0].message) == (play_arcmin > 0.0)
