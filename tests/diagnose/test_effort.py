"""A search ends after so much work, whatever the machine, and says so."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario

from hdsim.diagnosis import effort
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.opening import bench_for
from hdsim.estimate.state import state_of
from hdsim.simulation.ensemble import in_threads


def hidden(angle, velocity):
    """A ripple, friction that fades, and a weight on the output."""
    fading = 0.06 * np.exp(-((velocity / 6.0) ** 2)) * np.tanh(velocity / 0.5)
    return 0.02 * np.sin(2.0 * angle + 0.4) + fading + 0.06 * np.sin(angle / 100.0 + 0.3)


def diagnosed(tmp_path, **options):
    found = diagnose([rigid_record(12.0, extra=hidden)], scenario(tmp_path), **options)
    warnings = [problem.message for problem in found.verdict.data_problems if problem.kind == "search"]
    return found.bench, [effect.name for effect in found.verdict.effects], warnings


@pytest.mark.slow
def test_a_search_that_has_done_enough_keeps_its_first_names_and_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(effort, "MOST_WORK", 0.0)
    short, names, said = diagnosed(tmp_path)
    whole, every, nothing = diagnosed(tmp_path, thorough=True)
    assert "ended after 2 passes" in said[0]
    assert "--thorough" in said[0]
    assert not nothing
    assert len(every) == 3
    assert names == every[:2]
    assert effort.work_of(short) < 0.8 * effort.work_of(whole)


@pytest.mark.parametrize(("passes", "steps", "enough"), [(1, 3e7, False), (2, 1e7, False), (2, 3e7, True)])
def test_two_passes_are_made_whatever_they_take(passes, steps, enough):
    predictor = SimpleNamespace(steps=[steps], record=SimpleNamespace(time=np.zeros(1000)))
    assert effort.enough_done(SimpleNamespace(predictors=[predictor]), passes) == enough


def test_work_is_the_same_in_any_number_of_threads(tmp_path):
    base = scenario(tmp_path, "lumped")
    state = state_of(base)
    done = set()
    for threads in (1, 2):
        bench = bench_for([rigid_record(2.0)], [], base)
        with in_threads(threads):
            bench.predict_all([state] * 6)
        assert len(bench.predictors[0].steps) == 6
        assert len(set(bench.predictors[0].steps)) == 1
        done.add(effort.work_of(bench))
    (work,) = done
    assert work > 6 * len(bench.predictors[0].record.time) / effort.SAMPLES_A_STEP
