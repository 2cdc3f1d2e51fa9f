"""What is said of each kind of verdict, from evidence written by hand."""

import io
import math

import numpy as np
import pytest
from rich.console import Console
from telling import (
    EFFECT,
    GAP,
    KINDS,
    NOTHING,
    PARAMETER,
    UNKNOWN,
    candidate,
    law,
    page,
    place,
    rest,
    stage,
    told,
)

from hdsim.diagnosis.evidence import HeldOutEvidence
from hdsim.diagnosis.further import CurveFound
from hdsim.diagnosis.remains import remains
from hdsim.diagnosis.verdict import Remainder, TeethFound
from hdsim.estimate.found import ParameterEstimate
from hdsim.tell.beside import also_moved
from hdsim.tell.terminal import show
from hdsim.tell.wording import farthest, headline, meaning, much_left, sureness

FRICTION = "drive.friction.coulomb_nm"
CURVE = CurveFound(
    words="torque on the output over output angle", coordinate="output_angle", coordinate_unit="rad",
    acts_on="output_torque", at=[-1.0, 0.0, 1.5], values=[0.25, -0.125, 0.75],
    intervals=[(0.2, 0.3), (-0.2, -0.05), (0.5, 1.0)], unit="N m", share=0.4,
    tried={"torque on the output over output angle": 0.4, "torque on the motor over time": 0.1},
)  # fmt: skip


def confident(probability: float, **evidence):
    """A named effect of this probability."""
    found = told(EFFECT)
    effects = [one.model_copy(update={"confidence": probability}) for one in found.verdict.effects]
    return type(found)(
        found.verdict.model_copy(update={"effects": effects}), EFFECT.model_copy(update=evidence)
    )


@pytest.mark.parametrize(
    ("probability", "words", "number"),
    [
        (0.999, "Very sure", "over 99 in 100"),
        (0.97, "Very sure", "19 in 20"),
        (0.9, "Sure", "9 in 10"),
        (0.72, "Fairly sure", "7 in 10"),
        (0.5, "Not sure", "5 in 10"),
    ],
)
def test_a_name_is_as_sure_as_it_is_likely(probability, words, number):
    sure = sureness(confident(probability))
    assert sure.words == words
    assert sure.number == f"{number} of such verdicts are right"


@pytest.mark.parametrize(
    ("evidence", "left"),
    [
        ({"rest": rest(4.2)}, "4.2 times the noise of the motor torque in a.csv"),
        ({"explained": 0.84}, "16\u00a0% of the systematic residual"),
        (
            {"rest": rest(50.0), "explained": 0.23},
            "50 times the noise of the motor torque in a.csv and 77\u00a0%",
        ),
    ],
)
def test_nothing_is_very_sure_while_much_is_left(evidence, left):
    found = confident(0.995, **evidence)
    sure = sureness(found)
    assert sure.words == "Sure"
    assert left in sure.left
    assert "very" not in sure.sentence.lower()


def test_what_is_left_is_on_the_page(tmp_path):
    assert "<p class='left'>But 16\u00a0% of the systematic residual remains.</p>" in page(
        confident(0.995, explained=0.84), tmp_path
    )
    assert "class='left'" not in page(confident(0.995), tmp_path)


def test_little_that_is_left_is_not_much():
    assert much_left(confident(0.99, rest=rest(1.9), explained=0.91)) == ""
    assert much_left(told(NOTHING)) == ""


def test_numbers_that_are_far_off_are_not_very_sure_while_much_is_left():
    number = ParameterEstimate(value=0.045, interval=(0.0449, 0.0451), start=0.03)
    fields = {"parameters": {FRICTION: number}, "moved": [FRICTION]}
    assert sureness(told(PARAMETER, **fields)).words == "Very sure"
    left = told(PARAMETER.model_copy(update={"rest": rest(3.0)}), **{"verdict": "parameter"} | fields)
    assert sureness(left).sentence.startswith("Sure: ")
    assert sureness(left).sentence.endswith("But 3.0 times the noise of the motor torque in a.csv remains.")


def test_a_group_is_sure_as_a_group():
    found = told(EFFECT.model_copy(update={"laws": [law(group=["unbalance"])]}))
    assert "(not distinguishable with these data)" in headline(found)
    assert "that it is one of these, not which" in sureness(found).words


def test_each_of_several_names_has_its_own_probability():
    found = told(EFFECT.model_copy(update={"laws": [law(), law("unbalance", sampled=0.95, needed=0.97)]}))
    first, second, chance = sureness(found).details
    assert first == "Motor torque ripple: over 99 in 100 of such identifications are right."
    assert second.startswith("Unbalance: ")
    assert "less than 0.25\u00a0% of cases" in chance
    assert sureness(found).number.endswith("of such identifications are right")


def test_what_a_name_leaves_is_said_with_its_place():
    stages = [stage(0.9, 0.0025), stage(0.4, 0.0025)]
    evidence = EFFECT.model_copy(update={"explained": 0.91, "left_chance": 0.0025, "stages": stages})
    found = told(evidence, remains=remains(evidence))
    assert headline(found).endswith(
        "9\u00a0% of the systematic residual remains, a function of the output angle."
    )
    assert remains(EFFECT.model_copy(update={"explained": 0.91, "left_chance": 0.5})) is None  # chance
    assert remains(evidence.model_copy(update={"explained": 0.99})) is None  # too little to say


def test_a_curve_beside_a_name_is_what_the_name_leaves(tmp_path):
    changed = {"explained": 0.91, "left_chance": 0.0025}
    found = told(EFFECT.model_copy(update=changed), curve=CURVE, scenario="out/found.yaml")
    text = page(found, tmp_path)
    assert "Residual of the identified effects" in text
    assert "9\u00a0% of the systematic residual of the re-fitted model does not follow the equation" in text
    assert "The unidentified effect as a curve" not in text
    assert "the model with the result" in text
    assert "with the curve" not in text
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")


def test_what_has_no_name_is_said_with_what_came_nearest(tmp_path):
    found = told(UNKNOWN, suspects={"stribeck_friction": 0.86})
    said = headline(found)
    assert "Stribeck" in said
    assert "86\u00a0% of the systematic residual" in said
    text = page(found, tmp_path)
    assert "nothing in the catalogue explains" not in text.lower()
    assert "No known effect comes close" not in text
    assert "Sure that something is missing, not what" in text
    assert any(f"is right in {n} in 10 cases" in text for n in range(6))


def test_a_fitted_candidate_comes_nearest_where_no_law_was_added():
    stages = [
        stage(0.9, 0.0025, candidates=[candidate("unbalance", 0.3), candidate("stribeck_friction", 0.6)])
    ]
    said = headline(told(UNKNOWN.model_copy(update={"laws": [], "stages": stages})))
    assert "Stribeck" in said
    assert "60\u00a0%" in said
    assert "No known effect comes close" in headline(
        told(UNKNOWN.model_copy(update={"laws": [], "stages": [stage(0.9, 0.0025)]}))
    )


def test_vibration_is_called_so():
    shaken = stage(0.9, 0.0025)
    shaken.places = [place("frequency", 0.7)]
    assert "is vibration excited by the motion" in headline(
        told(UNKNOWN.model_copy(update={"stages": [shaken]}))
    )


ONCE = Remainder(record="a.csv", channel="motor_torque", times_noise=16.0, start_s=0.5, end_s=0.9)
PLACELESS = UNKNOWN.model_copy(update={"laws": [], "left": 0.02, "left_chance": 0.5, "stages": []})


def test_what_happens_once_is_said_with_its_time():
    found = told(PLACELESS, remainder=ONCE)
    assert "between 0.5 and 0.9 s" in headline(found)
    assert "perhaps once only" in meaning(found)
    assert sureness(found).number == "a residual of 16 times the noise"


@pytest.mark.parametrize("changes", [{"curve": CURVE}, {}])
def test_a_pattern_is_not_said_to_happen_once(changes):
    evidence = PLACELESS if changes else UNKNOWN
    found = told(evidence, remainder=ONCE, **changes)
    assert "between 0.5" not in headline(found)
    assert "once" not in meaning(found)


def test_a_suspect_that_may_be_chance_is_not_sure():
    evidence = PLACELESS.model_copy(
        update={"laws": [law(chance=0.3, sampled=0.4)], "rest": rest(1.0), "held": HeldOutEvidence(slope=0.0)}
    )
    found = told(evidence)
    assert found.verdict.verdict == "unknown"
    assert sureness(found).words == "Not sure that anything is missing"


def test_nothing_is_said_with_what_is_left(tmp_path):
    gap = {"motor_torque": GAP.model_copy(update={"after": 1.25 * GAP.noise})}
    text = page(told(NOTHING, gap=gap), tmp_path)
    assert "The data show no effect that is missing from the model." in text
    # On which data: the reasons below it are of the training data.
    assert "the held-out residual is 1.2 times the noise" in text
    assert "raining residual of the worst channel" in text
    assert "may still be there" in text


def test_what_the_data_make_doubtful_comes_first():
    for evidence in KINDS.values():
        fields = {"parameters": {FRICTION: ParameterEstimate(value=1.0)}, "moved": [FRICTION]}
        found = told(evidence, sentence="Check the data first: a: b is c. And so on.", **fields)
        assert headline(found).startswith("Check the data first (below). ")


def test_a_number_that_is_off_is_said_though_no_interval_excludes_it():
    number = ParameterEstimate(value=1.3, interval=(0.9, 1.8), start=1.0)
    found = told(PARAMETER, parameters={"motor_torque_gain": number}, moved=["motor_torque_gain"])
    assert "most simply motor torque gain" in headline(found)
    sure = sureness(found)
    assert "not which" in sure.words
    assert "75\u00a0%" in sure.number  # of GAP, by the re-fit


def test_how_far_a_number_moved_is_in_standard_errors_of_its_logarithm():
    width = 0.02  # standard deviation of the logarithm
    bounds = (0.04 * np.exp(-2 * width), 0.04 * np.exp(2 * width))
    number = ParameterEstimate(value=0.04, interval=bounds, start=0.04 * np.exp(-5 * width))
    found = told(PARAMETER, parameters={"x": number}, moved=["x"])
    assert farthest(found.verdict) == pytest.approx(5.0)


def test_a_number_without_a_spread_is_infinitely_far_and_does_not_crash():
    number = ParameterEstimate(value=0.04, interval=(0.04, 0.04), start=0.03)
    found = told(PARAMETER, parameters={FRICTION: number}, moved=[FRICTION])
    assert math.isinf(farthest(found.verdict))
    assert sureness(found).number == "over 100 standard errors"


def test_what_a_verdict_says_of_teeth_is_said_where_it_says_what_it_means():
    found = told(EFFECT)
    teeth = TeethFound(sentences=["It is tooth 57 (56 to 58) of the flexspline."])
    plain = meaning(found)
    said = meaning(type(found)(found.verdict.model_copy(update={"teeth": teeth}), EFFECT))
    assert said == f"{plain} It is tooth 57 (56 to 58) of the flexspline."
    written = teeth.model_copy(update={"scenario": "out/toothed.yaml"})
    said = meaning(type(found)(found.verdict.model_copy(update={"teeth": written}), EFFECT))
    assert said.endswith("toothed.yaml.")


def test_parameters_that_moved_beside_an_effect_are_told_and_those_that_may_be_chance_are_not(tmp_path):
    far = ParameterEstimate(value=0.439, interval=(0.41, 0.47), start=0.087)
    near = ParameterEstimate(value=0.021, interval=(0.0201, 0.0219), start=0.02)
    numbers = {"drive.friction.load_coefficient": far, FRICTION: near}
    moved = {"parameters": numbers, "moved": list(numbers)}
    found = told(EFFECT, **moved)
    said = also_moved(found.verdict)
    assert said == "Beside that the fit has changed: load coefficient of friction 0.439 instead of 0.087."
    assert said in page(found, tmp_path)
    terminal = Console(width=100, record=True, file=io.StringIO())
    show(found, terminal)
    assert said in " ".join(terminal.export_text().split())
    assert also_moved(told(EFFECT, parameters={FRICTION: near}, moved=[FRICTION]).verdict) == ""
    # Of a wrong parameter the headline speaks itself.
    assert also_moved(told(PARAMETER, **moved).verdict) == ""
