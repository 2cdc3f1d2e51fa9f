"""What to measure next, where a diagnosis leaves something open."""

import html
from dataclasses import replace

import pytest

import hdsim
from hdsim.diagnosis.following import NOTHING, candidates
from hdsim.diagnosis.verdict import Verdict
from hdsim.tell.save import save


@pytest.mark.slow
def test_a_group_gets_its_next_experiment_as_a_scenario_that_runs(diagnosis, base, tmp_path):
    own = replace(
        diagnosis.named[0],
        group={"stribeck_friction": 0.99},
        alternatives={"stribeck_friction": diagnosis.refit.fit},
    )
    effect = diagnosis.verdict.effects[0].model_copy(update={"indistinguishable_from": ["stribeck_friction"]})
    verdict = diagnosis.verdict.model_copy(update={"effects": [effect]})
    report = save(replace(diagnosis, named=[own], verdict=verdict), base, tmp_path).read_text(
        encoding="utf-8"
    )
    kept = Verdict.model_validate_json((tmp_path / "verdict.json").read_text(encoding="utf-8"))
    proposal = kept.next_experiment
    assert proposal.between == ["motor_torque_ripple", "stribeck_friction"]
    assert proposal.scenario == str(tmp_path / "next.yaml")
    assert html.escape(proposal.sentence) in report
    assert hdsim.load_scenario(proposal.scenario).run.duration_s > 0
    assert proposal.considered[0].separation == max(c.separation for c in proposal.considered)


def test_only_what_the_data_leave_open_is_to_be_measured_again(diagnosis):
    own = diagnosis.named[0]
    assert candidates(diagnosis) == {}
    unlikely = diagnosis.verdict.effects[0].model_copy(update={"confidence": 0.6})
    weak = diagnosis.verdict.model_copy(update={"effects": [unlikely]})
    found = candidates(replace(diagnosis, verdict=weak))
    assert list(found) == [own.name, NOTHING]
    assert found[NOTHING] is diagnosis.refit.fit
    bench = diagnosis.bench
    # The effect's fit, carried on to its very end.
    settled = found[own.name]
    assert [added.effect for added in settled.state.added] == [own.name]
    assert settled.state.added[0].coefficients == pytest.approx(own.fit.state.added[0].coefficients, rel=0.01)
    assert bench.power(settled.predictions) <= bench.power(own.fit.predictions) * (1 + 1e-6)
    silent = weak.model_copy(update={"verdict": "nothing"})
    assert candidates(replace(diagnosis, verdict=silent)) == {}
