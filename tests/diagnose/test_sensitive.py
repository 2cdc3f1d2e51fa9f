"""A drive that rattles: its own numbers leave what another reading of the motion would change as much."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record
from diagnose_bench import scenario as rigid_scenario
from moves import positioned
from noisy import noisy

import hdsim
from hdsim.diagnosis import search as searching
from hdsim.diagnosis import sensitive
from hdsim.diagnosis.effort import told_of_end
from hdsim.diagnosis.passes import Search
from hdsim.diagnosis.sensitive import DRAWS, within_motion_noise
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

NOISE = {"motor_angle": 2e-5, "output_angle": 3e-6, "motor_torque": 5e-3}
#: An arm that hangs near its lowest point: no weight closes the gap for long.
PLAY = {"output_backlash": {"backlash_arcmin": 2.0}}
RIPPLE = {"motor_torque_ripple": {"components": [{"order": 2, "cogging_nm": 0.05}]}}


def drive(effects) -> Scenario:
    chirp = {
        "type": "chirp", "amplitude_deg": 3.0, "start_frequency_hz": 0.1, "end_frequency_hz": 2.0,
        "duration_s": 10.0,
    }  # fmt: skip
    return Scenario.model_validate({
        "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
        "command": positioned(chirp),
        "effects": effects,
        "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 4.0, "centre_of_mass_m": 0.3}},
        "run": {"duration_s": 10.0, "sample_rate_hz": 500.0},
    })  # fmt: skip


def held_against(plant, model):
    """A model held against the record of a plant, weighed by what it leaves, beside a re-fitted base."""
    base = state_of(drive({}))
    bench = bench_for([noisy(hdsim.simulate(drive(plant)), NOISE, seed=5)], [], drive({}), None)
    found = refit(bench, base).fit
    if model:
        found.state = state_of(drive(model))
        found.predictions = bench.predict(found.state)
    bench.weigh(bench.residuals(found.predictions))
    return bench, found


def test_what_the_true_play_leaves_is_what_another_reading_of_the_motion_changes():
    bench, found = held_against(PLAY, PLAY)
    assert bench.power(found.predictions) > 10.0 * bench.noise_power
    assert within_motion_noise(bench, found)


@pytest.mark.parametrize(
    ("plant", "model"), [(RIPPLE, {}), (PLAY | RIPPLE, PLAY), (PLAY, {})], ids=["ripple", "both", "play"]
)
def test_what_is_missing_is_more_than_that(plant, model):
    bench, found = held_against(plant, model)
    assert bench.power(found.predictions) > 2.0 * bench.noise_power
    assert not within_motion_noise(bench, found)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A rigid drive in which a ripple is missing."""
    base = rigid_scenario(tmp_path_factory.mktemp("bench"))
    record = rigid_record(extra=lambda angle, _: 0.02 * np.sin(2.0 * angle))
    bench = bench_for([record], [], base, None)
    return bench, refit(bench, state_of(base)).fit


@pytest.mark.parametrize(("power", "asked"), [(0.05, 1), (0.5, DRAWS)])
def test_one_in_ten_draws_decides_and_far_from_it_the_first(fitted, monkeypatch, power, asked):
    bench, found = fitted
    draws: list[int] = []

    def answers(bench, state, count, **_):
        for seed in range(count):
            draws.append(seed)
            rests = bench.residuals(bench.predict(state))
            yield {k: np.sqrt(power) * rest for k, rest in enumerate(rests)}

    monkeypatch.setattr(sensitive, "answers", answers)
    assert not within_motion_noise(bench, found)
    assert draws == 2 * list(range(asked))  # as given, and as it is


def test_a_search_ends_there_and_says_so(fitted, monkeypatch):
    bench, found = fitted
    monkeypatch.setattr(searching, "within_motion_noise", lambda *_: True)
    monkeypatch.setattr(searching, "more_could", lambda *_: True)
    search = Search(found, searching.left_of(bench, found), named=[SimpleNamespace(name="output_backlash")])
    assert searching._next(bench, found, search, lambda *_: lambda _: None) is None
    assert search.sensitive
    (said,) = told_of_end(bench, search)
    assert said.severity == "warning"
    assert "another reading of the measured motion" in said.message
    search.thorough = True
    monkeypatch.setattr(searching, "_one_more", lambda *_: None)
    assert searching._next(bench, found, search, lambda *_: lambda _: None) is None
    assert not search.sensitive
    assert told_of_end(bench, search) == []
