"""A held-out motion that shows what no training record does: the verdict, which cannot know, says so."""

from copy import deepcopy

import pytest
from moves import NOISE, positioned
from noisy import noisy

import hdsim
from hdsim.estimate.opening import bench_for
from hdsim.estimate.prove import unseen
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

BASE = {
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": positioned({"type": "sine", "amplitude_deg": 10.0, "frequency_hz": 0.7, "phase_deg": -90}),
    "load": {"inertia_kg_m2": 0.3},
    "run": {"duration_s": 3.0, "sample_rate_hz": 500.0},
}


def record(effects, name):
    plant = deepcopy(BASE) | {"effects": effects}
    return noisy(hdsim.simulate(Scenario.model_validate(plant)), NOISE, seed=len(name), name=name)


@pytest.mark.parametrize(("trained", "held"), [({}, True), ({}, False), ("the same", True)])
def test_what_only_held_out_data_show_is_said(trained, held):
    error = {"kinematic_error": {"components": [{"order": 2, "amplitude_arcmin": 0.6, "phase_deg": 40.0}]}}
    learned = record(error if trained else {}, "learned")
    proof = record(error if held else {}, "proof")
    base = Scenario.model_validate(BASE)
    bench = bench_for([learned], [proof], base)
    found = unseen(bench, bench.predict(state_of(base), everything=True))
    if held and not trained:
        (problem,) = (p for p in found if p.channel == "output_angle")
        assert (problem.record, problem.kind, problem.severity) == ("proof", "held out", "warning")
    else:
        assert not found
