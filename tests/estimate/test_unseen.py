"""A held-out motion that shows what no training data do: the verdict, which cannot know, says so."""

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


@pytest.mark.parametrize(("amplitude_arcmin", "said"), [(0.0, False), (0.036, True)])
def test_a_little_that_only_held_out_data_show_is_said_where_no_effect_is_named(amplitude_arcmin, said):
    effects = {"kinematic_error": {"components": [{"order": 2, "amplitude_arcmin": amplitude_arcmin}]}}
    base = Scenario.model_validate(BASE)
    for name in ("proof", "another", "a third"):
        proof = record(effects if amplitude_arcmin else {}, name)
        bench = bench_for([record({}, "learned")], [proof], base)
        predictions = bench.predict(state_of(base), everything=True)
        assert not unseen(bench, predictions)
        channels = [problem.channel for problem in unseen(bench, predictions, slightly=True)]
        assert channels == (["output_angle"] if said else [])


def both_ways(turns_back_s):
    """A record that turns one way, but for the last half second of 4.5 and what is asked for."""
    plant = deepcopy(BASE)
    back = {"type": "ramp", "velocity_deg_per_s": -30.0}
    moves = [
        {"type": "ramp", "velocity_deg_per_s": 30.0, "duration_s": turns_back_s},
        back | {"duration_s": 4.5 - turns_back_s},
    ]
    plant["command"] = positioned({"type": "sequence", "moves": moves})
    plant["run"]["duration_s"] = 4.5
    return noisy(hdsim.simulate(Scenario.model_validate(plant)), NOISE, seed=1)


@pytest.mark.parametrize("turns_back_s", [1.2, 2.2, 4.05])
def test_fits_see_each_direction_in_which_the_motor_turns(turns_back_s):
    """Stretches of half a second, the third, sixth and ninth of which are held out as a rule."""
    bench = bench_for([both_ways(turns_back_s)], [], Scenario.model_validate(BASE))
    series, speed = bench.series[0], bench.predictors[0].motor_velocity
    for way in (speed > 5.0, speed < -5.0):
        assert series.train[way].mean() > 0.25
        assert series.hold.mean() == pytest.approx(1 / 3, abs=0.02)


def test_a_stretch_that_shows_what_no_other_does_is_said():
    base = Scenario.model_validate(BASE)
    record_ = record({}, "learned")
    held = bench_for([record_], [], base).series[1].hold
    record_.channels["output_angle"] = record_.channels["output_angle"] + 1e-4 * held
    bench = bench_for([record_], [], base)
    [said] = unseen(bench, bench.predict(state_of(base), everything=True))
    assert (said.channel, said.kind) == ("output_angle", "held out")
    assert "stretch" in said.message
