"""Names are asked for once more beside all others: what each is needed for, and which none needs."""

from dataclasses import replace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario

from hdsim.diagnosis.revise import NEEDLESS, needed, revised
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.refit import together


def hidden(angle, velocity):
    """A ripple of the motor and friction that falls with speed, neither of which the base has."""
    return 0.02 * np.sin(6 * angle) + 0.05 * np.tanh(velocity / 0.5) * np.exp(-np.abs(velocity) / 6.0)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    return diagnose([rigid_record(extra=hidden)], scenario(folder))


@pytest.mark.slow
def test_both_of_two_hidden_effects_are_named_and_needed(pair):
    assert {effect.name for effect in pair.verdict.effects} >= {"motor_torque_ripple"}
    assert len(pair.verdict.effects) == 2
    assert all(law.needed > 0.9 for law in pair.evidence.laws)


@pytest.mark.slow
def test_a_name_that_nothing_needs_is_taken_back(pair):
    third = next(
        one.added
        for one in pair.stages[0].screening.ranked
        if one.name not in {named.name for named in pair.named}
    )
    state = replace(pair.final.state, added=(*pair.final.state.added, third))
    crowded = together(pair.bench, pair.final, state)
    names = [*pair.named, replace(pair.named[-1], name=third.effect)]
    assert needed(pair.bench, pair.final, crowded) < NEEDLESS
    after = revised(pair.bench, crowded, names, lambda _: None)
    assert [one.name for one in names] == [one.name for one in pair.named]
    assert pair.bench.power(after.predictions) == pytest.approx(
        pair.bench.power(pair.final.predictions), rel=1e-2
    )


def test_a_model_without_a_needed_name_lacks_nearly_all_that_it_explained(pair):
    without = together(pair.bench, pair.final, replace(pair.final.state, added=pair.final.state.added[:1]))
    assert needed(pair.bench, without, pair.final) > 0.9
    assert needed(pair.bench, pair.final, pair.final) == 0.0
