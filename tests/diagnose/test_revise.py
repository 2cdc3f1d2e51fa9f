"""Names are asked for once more beside all others: what each is needed for, and which none needs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario
from moves import MOVES, NOISE
from noisy import noisy

import hdsim
from hdsim.diagnosis.revise import NEEDLESS, _least_needed, base_alone, needed, revised, stand_ins
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.refit import together
from hdsim.scenario import Scenario


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


@pytest.mark.parametrize(
    ("weight_alone", "error_alone", "sizes", "expected"),
    [
        ((12.0, 400.0), (90.0, 300.0), (5.0, 5.0), None),  # only the weight explains the torque
        ((12.0, 1200.0), (16.0, 300.0), (5.0, 5.0), None),  # only the error explains all of the angle
        ((12.0, 400.0), (16.0, 300.0), (5.0, 5.0), (0, 1)),  # parts lacking where most: 0.03 and 0.06
        ((16.0, 400.0), (12.0, 300.0), (5.0, 5.0), (1, 0)),  # 0.06 and 0.02
        ((12.0, 400.0), (90.0, 300.0), (1.9, 1.9), (0, 1)),  # neither size is told from nothing
        ((12.0, 400.0), (90.0, 300.0), (1.9, 2.0), None),
    ],
)
def test_two_names_are_one_only_where_either_alone_explains_each_channel(
    monkeypatch, weight_alone, error_alone, sizes, expected
):
    """Powers of torque and angle: 110 and 10,100 with neither name, 10 and 100 (the noise) with both.

    Sizes in standard deviations: 1.96 of a single number are told from nothing.
    """

    def fitted(powers):
        added = [SimpleNamespace(at_limit=False, coefficients=(size,)) for size in sizes]
        return SimpleNamespace(
            predictions=powers,
            state=SimpleNamespace(added=added),
            covariance=np.eye(2),
            numbers_of=lambda k: slice(k, k + 1),
        )

    bench = SimpleNamespace(
        noise_powers={"motor_torque": 10.0, "output_angle": 100.0},
        channel_powers=lambda powers: dict(zip(("motor_torque", "output_angle"), powers, strict=True)),
        power=sum,
    )
    monkeypatch.setattr("hdsim.diagnosis.revise.without", lambda *_: fitted((110.0, 10100.0)))
    named = [SimpleNamespace(name="unbalance"), SimpleNamespace(name="sensors")]
    others = [fitted(error_alone), fitted(weight_alone)]
    assert stand_ins(bench, fitted((10.0, 100.0)), named, others) == expected


def test_what_looked_like_a_name_beside_another_of_the_same_effect_does_not_look_like_that(monkeypatch):
    """Of two names of one effect the second explains what the first's formula leaves, and so do many."""
    first = SimpleNamespace(name="unbalance", group={"position_dependent_friction": 1.0}, alike=frozenset())
    second = SimpleNamespace(name="sensors", group={"damaged_tooth": 1.0}, alike=frozenset())
    fitted = SimpleNamespace(predictions=1.0)
    bench = SimpleNamespace(power=lambda predictions: predictions)
    for name, does in {
        "without": lambda *_, **__: fitted,
        "needed": lambda *_: 1.0,
        "stand_ins": lambda *_: (0, 1),
        "together": lambda *_: fitted,
    }.items():
        monkeypatch.setattr(f"hdsim.diagnosis.revise.{name}", does)
    named = [first, second]
    revised(bench, fitted, named, str)
    assert named == [first]
    assert first.alike == {"unbalance", "sensors"}
    assert set(first.group) == {"position_dependent_friction"}


@pytest.mark.parametrize(
    ("rough", "at_the_end", "settled", "least"),
    [
        ((0.9, 0.05, 0.8), (0.9, 0.01, 0.8), [], 1),  # needless already: nobody need go on
        ((0.9, 0.3, 0.8), (0.9, 0.05, 0.02), [1], 1),  # the first that turns out needless
        ((0.9, 0.3, 0.8), (0.9, 0.3, 0.05), [1, 2], 2),
        ((0.9, 0.3, 0.8), (0.2, 0.3, 0.8), [1, 2, 0], 0),  # none is, and all have been asked
    ],
)
def test_models_without_a_name_are_carried_on_until_one_is_needless(
    monkeypatch, rough, at_the_end, settled, least
):
    gone_on = []

    def to_its_end(_, k):
        gone_on.append(k)
        return k

    monkeypatch.setattr("hdsim.diagnosis.revise.settled", to_its_end)
    monkeypatch.setattr("hdsim.diagnosis.revise.needed", lambda _, k, __: at_the_end[k])
    named = [SimpleNamespace(needed=part) for part in rough]
    assert _least_needed(None, None, named, [0, 1, 2]) == least
    assert gone_on == settled


@pytest.mark.parametrize(
    ("named", "alone", "better"),
    [
        (200.0, 210.0, True),  # the base's numbers do all that the name was given for
        (200.0, 900.0, False),  # most of it goes with the name
        (995.0, 996.0, False),  # the name was given for next to nothing
    ],
)
def test_a_name_is_none_where_the_base_explains_as_much_from_there(monkeypatch, named, alone, better):
    fits = {power: SimpleNamespace(predictions=power) for power in (1000.0, named, alone)}
    bench = SimpleNamespace(power=float, noise_power=150.0)
    monkeypatch.setattr("hdsim.diagnosis.revise.without", lambda *_, **__: fits[alone])
    monkeypatch.setattr("hdsim.diagnosis.revise.together", lambda _, found: found)
    assert base_alone(bench, fits[1000.0], fits[named]) is (fits[alone] if better else None)


@pytest.mark.study
def test_half_a_stiffness_is_no_friction():
    """The re-fit ends at another minimum, out of which it comes beside whatever is named."""
    load = MOVES["load"] | {"gravity": {"mass_kg": 5.0, "centre_of_mass_m": 0.3}}
    true = Scenario.model_validate(MOVES | {"load": load, "run": MOVES["run"] | {"duration_s": 8.0}})
    halves = {"stiffness_k1_nm_per_rad": 8000.0, "stiffness_k2_nm_per_rad": 12500.0}
    base = true.with_({f"drive.torsion.{name}": value for name, value in halves.items()})
    verdict = diagnose([noisy(hdsim.simulate(true), NOISE, seed=1)], base).verdict
    assert verdict.verdict == "parameter"
    assert verdict.moved == ["drive.torsion.stiffness_k1_nm_per_rad"]
    assert verdict.parameters[verdict.moved[0]].value == pytest.approx(16000.0, rel=0.01)
    assert verdict.gap["output_angle"].after < 1.1 * verdict.gap["output_angle"].noise
