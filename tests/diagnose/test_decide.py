"""The verdict as a pure function of the evidence."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.diagnosis.decide import decide, weighed
from hdsim.diagnosis.evidence import Evidence, HeldOutEvidence, LawEvidence, RestEvidence
from hdsim.diagnosis.rules import RULES, Rules
from hdsim.diagnosis.workflow import _Judged


def law(name: str = "kinematic_error", **changes) -> LawEvidence:
    return LawEvidence(**{"name": name, "chance": 0.005, "sampled": 1.0, "gain": 0.9} | changes)


def found(*laws: LawEvidence, **changes) -> Evidence:
    return Evidence(**{"laws": list(laws), "explained": 0.99, "left_chance": 0.002} | changes)


def test_nothing_found_is_nothing_missing():
    assert decide(Evidence(rest=RestEvidence(record="a", channel="b", times_noise=1.1))).kind == "nothing"


def test_a_law_that_explains_most_is_named_though_no_formula_is_exact():
    """An eccentricity with a second harmonic: 86 % of the structure is its law's, however strong it is."""
    decision = decide(found(law(), explained=0.86, left=0.6, held=HeldOutEvidence(slope=0.95, spread=0.01)))
    assert decision.kind == "effect"
    assert decision.confidence[0] > 0.7


def test_a_law_that_explains_little_is_not():
    little = found(law(own_left=0.6), explained=0.3, held=HeldOutEvidence(slope=0.9, spread=0.05))
    assert decide(little).kind == "unknown"


def test_the_p_value_of_what_is_unknown_is_the_one_that_is_told():
    """A law that is not believed was found with a p-value; what it leaves has another, which is not asked."""
    weak = found(law(chance=0.0075), explained=0.3, left_chance=0.025, held=HeldOutEvidence(slope=-0.8))
    decision = decide(weak)
    assert decision.kind == "unknown"
    (asked,) = (reason for reason in decision.because if reason.rule == "structure is left by chance")
    assert asked.seen == weak.pattern_chance == 0.0075
    assert asked.holds


def test_what_another_missing_effect_leaves_does_not_take_a_name_away():
    """A real joint lacks friction and more: its friction is clear, though half of the structure is left."""
    held = HeldOutEvidence(slope=1.0, spread=0.2)
    assert decide(found(law("input_coulomb_viscous"), explained=0.5, held=held)).kind == "effect"


@pytest.mark.parametrize(
    ("explained", "sharp", "kind"),
    [
        (0.12, False, "unknown"),  # a mesh loss that stands in for a part of what a motor's saturation does
        (0.12, True, "effect"),  # a line in an order spectrum that held-out data repeat
        (0.67, False, "effect"),  # most of what is missing
    ],
)
def test_a_name_that_explains_less_than_it_leaves_is_none(explained, sharp, kind):
    beside = {
        "held": HeldOutEvidence(slope=0.9, spread=0.05),
        "rest": RestEvidence(record="a", channel="b", times_noise=29.0),
    }
    beside |= {"rest_before": beside["rest"], "left": 0.7}
    assert decide(found(law(sharp=sharp), explained=explained, **beside)).kind == kind


def test_held_out_data_that_hardly_excite_an_effect_do_not_judge_it():
    silent = found(law(), held=HeldOutEvidence(slope=-1.25, spread=3.0))
    without = found(law(), held=HeldOutEvidence(slope=0.5, spread=3.0))
    assert decide(silent).kind == "effect"
    assert decide(silent).confidence[0] == pytest.approx(decide(without).confidence[0], abs=0.05)


def test_held_out_data_that_do_excite_it_and_do_not_show_it_take_the_name_away():
    held = HeldOutEvidence(slope=0.1, spread=0.05)
    assert decide(found(law(), explained=0.9, held=held)).kind == "unknown"


@pytest.mark.parametrize(
    ("patterned", "times_noise", "kind"),
    [(0.4, 1.1, "unknown"), (0.05, 2.5, "unknown"), (0.05, 1.3, "nothing")],
)
def test_an_effect_that_is_not_believed_tells_of_nothing_by_itself(patterned, times_noise, kind):
    """What was there without it decides, as where nothing was proposed."""
    before = RestEvidence(record="a", channel="b", times_noise=times_noise)
    proposed = found(
        law(),
        explained=0.6,
        held=HeldOutEvidence(slope=-0.2, spread=0.1),
        patterned=patterned,
        rest_before=before,
    )
    assert decide(proposed).kind == kind


def test_a_number_at_the_end_of_its_range_counts_against_a_name():
    free, stuck = (decide(found(law(at_limit=a))).confidence[0] for a in (False, True))
    assert stuck < free


def test_what_the_re_fit_closes_is_a_parameter():
    assert decide(Evidence(fell=0.4)).kind == "parameter"


def test_what_is_left_beyond_the_noise_is_unknown():
    rest = RestEvidence(record="a", channel="motor_torque", times_noise=2.5)
    assert decide(Evidence(rest=rest)).kind == "unknown"


def test_a_second_name_that_explains_little_of_what_is_left_is_not_given():
    decision = decide(found(law(), law("damaged_tooth", needed=0.5)))
    assert decision.names == [0]


laws = st.builds(
    law,
    sampled=st.floats(0, 1),
    gain=st.floats(0, 1),
    needed=st.floats(0, 1),
    at_limit=st.booleans(),
)
evidence = st.builds(
    Evidence,
    laws=st.lists(laws, max_size=4),
    explained=st.floats(0, 1),
    left=st.floats(0, 1),
    left_chance=st.floats(0, 1),
    held=st.builds(HeldOutEvidence, slope=st.floats(-1e6, 1e6), spread=st.floats(0, 1e6)),
    fell=st.floats(-10, 1),
)


@settings(max_examples=200, deadline=None)
@given(evidence)
def test_every_rule_is_said_and_the_confidence_is_their_sum(given):
    decision = decide(given)
    assert len(decision.confidence) == len(given.laws)
    for k, p in enumerate(decision.confidence):
        assert 0.0 <= p <= 1.0
        assert (k in decision.names) == (p >= RULES.believed)
        said = [r.odds for r in decision.because if r.odds is not None and r.of == given.laws[k].name]
        assert all(any(w == odds for odds in said) for _, _, w in weighed(given, k, RULES))
    assert Evidence.model_validate_json(given.model_dump_json()) == given


@settings(max_examples=100, deadline=None)
@given(evidence.filter(lambda e: len(e.laws) > 0), st.floats(0.0, 0.4))
def test_more_explained_never_lowers_a_confidence(given, more):
    """The stronger an effect is, the less may its verdict fail."""
    better = given.model_copy(update={"explained": min(1.0, given.explained + more)})
    assert decide(better).confidence[0] >= decide(given).confidence[0] - 1e-12


def test_every_rule_says_its_unit_and_what_calibrated_it():
    for name, field in Rules.model_fields.items():
        extra = field.json_schema_extra
        assert field.description, name
        assert extra["unit"], name
        assert extra["calibrated_by"], name


def test_a_sharp_line_that_held_out_data_repeat_is_named_beside_a_larger_effect():
    """A ripple of the torque sensor beside friction: half of what is missing, all of it elsewhere."""
    seen, vague = HeldOutEvidence(slope=0.97, spread=0.02), HeldOutEvidence(slope=0.97, spread=0.5)
    first = law("input_coulomb_viscous")

    def named(held, *, sharp=True):
        line = law("sensors", gain=0.01, needed=0.5, own_left=0.3, sharp=sharp, held=held)
        return decide(found(first, line, held=HeldOutEvidence(slope=1.0, spread=0.05))).names

    assert named(seen) == [0, 1]
    # Not where it may be chance, nor a law that a search can bend.
    assert named(vague) == named(seen, sharp=False) == [0]


def test_a_later_effect_whose_own_change_held_out_data_do_not_show_is_not_named():
    absent, there = (HeldOutEvidence(slope=slope, spread=0.1) for slope in (0.2, 1.0))
    first = law("input_coulomb_viscous")

    def confidence(held):
        whole = HeldOutEvidence(slope=1.0, spread=0.05)  # the first one's, by far the larger
        return decide(found(first, law("sensors", needed=0.9, held=held), held=whole)).confidence[1]

    assert confidence(absent) < 0.5 < confidence(there)


@pytest.mark.parametrize(("spread", "names"), [(0.008, [0, 1]), (0.1, [0])])
def test_held_out_data_speak_for_a_later_law_where_all_of_them_show_it(spread, names):
    """A weak thermal friction beside an encoder's error: three quarters of what the torque lacks."""
    held = HeldOutEvidence(slope=1.04, spread=spread)
    evidence = found(law("sensors"), law("thermal_friction", needed=0.74, held=held))
    assert decide(evidence).names == names


def test_a_model_that_predicts_held_out_data_worse_than_the_one_as_given_has_no_names():
    """An effect may take back what the re-fit had bent, and no more."""
    taken_back = HeldOutEvidence(slope=0.65, spread=0.03)
    worse = HeldOutEvidence(slope=-0.25, spread=0.15)
    given = found(law(), explained=0.97, held=taken_back)
    assert decide(given).kind == "effect"
    assert decide(given.model_copy(update={"changed": worse})).kind == "unknown"
    blunt = HeldOutEvidence(slope=-0.25, spread=3.0)
    unsure = decide(given.model_copy(update={"changed": blunt}))
    assert unsure.confidence[0] == pytest.approx(decide(given).confidence[0], rel=0.05)
    shown = HeldOutEvidence(slope=1.0, spread=0.05)
    assert decide(given.model_copy(update={"changed": shown})) == decide(given)


def test_an_effect_with_which_held_out_data_are_predicted_worse_is_none():
    """A slope below a half is a larger residual than without it, whatever it explains of training data."""
    worse = found(law(), explained=0.97, held=HeldOutEvidence(slope=0.29, spread=0.05))
    assert decide(worse).kind == "unknown"
    blunt = found(law(), explained=0.97, held=HeldOutEvidence(slope=0.29, spread=0.5))
    assert decide(blunt).kind == "effect"


@pytest.mark.parametrize(
    ("own_left", "kind"),
    [
        (
            0.008,
            "effect",
        ),  # a rotor's unbalance on a real joint that has small errors of its own over the angle
        (0.056, "unknown"),  # a cable that an unbalance stands in for
    ],
)
def test_an_exact_formula_may_leave_what_a_real_machine_has_beside_it(own_left, kind):
    exact = law("unbalance", exact=True, own_first=True, own_left=own_left)
    rest = RestEvidence(record="a", channel="b", times_noise=3.0)
    assert decide(found(exact, left=0.3, patterned=0.9, rest=rest, rest_before=rest)).kind == kind


@pytest.mark.parametrize(("times_noise", "kind"), [(1.018, "nothing"), (1.1, "unknown")])
def test_structure_that_only_means_of_many_readings_show_is_nothing_that_is_missing(times_noise, kind):
    """A drive without an effect against a locked output: 12 % of what the means of four readings leave."""
    rest = RestEvidence(record="a", channel="b", times_noise=times_noise)
    assert decide(Evidence(left=0.1204, left_chance=0.0025, rest=rest)).kind == kind


def test_why_names_were_taken_back_is_kept_though_another_of_that_name_stays():
    weak = law(sharp=True, needed=0.1, own_left=0.3, held=HeldOutEvidence(slope=0.1, spread=0.05))

    def judged(*laws: LawEvidence) -> _Judged:
        evidence = found(*laws, held=HeldOutEvidence(slope=0.95, spread=0.01))
        return _Judged({}, {}, evidence, decide(evidence))

    first, second, last = judged(law(), weak, law("stribeck_friction")), judged(law(), weak), judged(law())
    second.instead_of(first, 2)
    last.instead_of(second, 1)
    likely = [(r.of, r.seen) for r in last.taken_back if r.rule == "likely enough for a name"]
    confidence = first.decision.confidence
    assert likely == [
        ("stribeck_friction", confidence[2]),
        ("kinematic_error", second.decision.confidence[1]),
    ]
    # Of what they were judged by, nothing is missing.
    assert (
        sum(r.of == "kinematic_error" for r in last.taken_back) == len(weighed(second.evidence, 1, RULES)) + 1
    )
