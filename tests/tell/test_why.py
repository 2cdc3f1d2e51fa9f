"""Why a verdict came about: every rule on the page and on the terminal, in plain words, for every kind."""

import html
import math
import re

import pytest
from rich.console import Console
from telling import EFFECT, KINDS, NOTHING, UNKNOWN, law, page, stage, told

from hdsim.diagnosis.decide import Reason, decide
from hdsim.diagnosis.evidence import Evidence, HeldOutEvidence
from hdsim.diagnosis.rules import RULES
from hdsim.estimate.found import Gap
from hdsim.tell.because import WORDINGS, conditions, weighings, wording
from hdsim.tell.terminal import show
from hdsim.tell.words import odds

LIKELY = "likely enough for a name"


@pytest.mark.parametrize("kind", KINDS)
def test_the_evidence_by_hand_is_of_its_kind(kind):
    assert decide(KINDS[kind]).kind == kind


@pytest.mark.parametrize("kind", KINDS)
def test_every_reason_is_on_the_page(kind, tmp_path):
    found = told(KINDS[kind])
    text = page(found, tmp_path)
    why = text[text.index("<h2>Why this verdict</h2>") : text.index("<h2>What the residual depends on")]
    for reason in found.verdict.because:
        if reason.rule != LIKELY:
            said = wording(reason.rule)
            assert html.escape(said.words)[1:] in why
            assert said.shown(reason.seen) in why
        if reason.odds is not None:
            assert odds(reason.odds) in why
        if reason.limit is not None:
            assert (
                wording(reason.rule).shown(reason.limit) in why or f"{100 * reason.limit:.0f}\u00a0%" in why
            )


@pytest.mark.parametrize("kind", KINDS)
def test_every_reason_is_on_the_terminal(kind):
    terminal = Console(width=120, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show(told(KINDS[kind]), terminal)
    text = " ".join(terminal.export_text().split())
    for reason in told(KINDS[kind]).verdict.because:
        if reason.rule != LIKELY:
            assert wording(reason.rule).words[1:] in text


def test_what_decide_asks_has_plain_words():
    worse = HeldOutEvidence(slope=-0.2, spread=0.1)
    laws = [law(at_limit=True), law("unbalance", needed=0.9)]
    two = EFFECT.model_copy(update={"laws": laws, "changed": worse})
    asked = [*decide(two).because, *decide(NOTHING).because, *decide(UNKNOWN).because]
    assert {reason.rule for reason in asked} - {LIKELY} == set(WORDINGS)


def test_the_bars_add_up_to_the_probability():
    evidence = EFFECT.model_copy(update={"laws": [law(), law("unbalance", needed=0.8, sampled=0.8)]})
    decision = decide(evidence)
    found = weighings(decision.because)
    assert [one.name for one in found] == ["motor_torque_ripple", "unbalance"]
    for one, probability in zip(found, decision.confidence, strict=True):
        assert one.prior == pytest.approx(RULES.odds)
        total = one.prior + sum(weight.log_odds for weight in one.weights)
        assert 1 / (1 + math.exp(-total)) == pytest.approx(probability)
        assert one.probability == pytest.approx(probability)
        assert one.needed == RULES.believed


def test_an_effect_that_was_found_twice_is_weighed_twice():
    evidence = EFFECT.model_copy(update={"laws": [law(), law(sampled=0.1, needed=0.2)]})
    first, second = weighings(decide(evidence).because)
    assert first.name == second.name
    assert (len(first.weights), len(second.weights)) == (4, 6)
    assert first.probability > second.probability


def test_what_is_not_believed_stands_beside_what_is(tmp_path):
    evidence = EFFECT.model_copy(
        update={"laws": [law(), law("unbalance", sampled=0.05, needed=0.1, at_limit=True)]}
    )
    found = told(evidence)
    assert [effect.name for effect in found.verdict.effects] == ["motor_torque_ripple"]
    text = page(found, tmp_path)
    assert re.search(r"<h3>Motor.torque ripple: identified", text)
    assert re.search(r"<h3>[^<]*nbalance[^<]*: not identified", text)
    assert "have been left out of the model" in text


def test_bars_point_to_the_side_that_the_evidence_speaks_for(tmp_path):
    text = page(told(UNKNOWN), tmp_path)
    for weight in weighings(told(UNKNOWN).verdict.because)[0].weights:
        row = text[text.index(f"<td>{html.escape(weight.words)}</td>") :].partition("</tr>")[0]
        assert f"<i class='{'for' if weight.log_odds >= 0 else 'against'}'" in row
        left, width = map(float, re.search(r"left:([\d.]+)%;width:([\d.]+)%", row).groups())
        assert (left >= 50.0) == (weight.log_odds >= 0)
        assert 0.0 <= left <= left + width <= 100.1


def test_a_limit_is_met_by_its_own_numbers_not_by_what_it_speaks_for():
    # Both must be met for a pattern; the chance alone is.
    evidence = NOTHING.model_copy(update={"left_chance": 0.001, "left": 0.05})
    chance, part, noise, excess, fall = conditions(decide(evidence).because)
    assert (chance.met, part.met, noise.met, excess.met, fall.met) == (True, False, False, False, False)
    assert chance.limit == "at most 2\u00a0%"
    assert part.limit == "at least 12\u00a0%"


def test_a_rule_that_has_no_words_here_is_told_by_its_own():
    reason = Reason(rule="the <moon> is full", of="unbalance", seen=0.25, odds=1.0, holds=True)
    (one,) = weighings([reason])
    assert one.weights[0].words == "The <moon> is full"
    assert one.weights[0].seen == "0.25"
    assert math.isnan(one.total)


@pytest.mark.parametrize(
    ("weight", "text"),
    [
        (0.0, "neutral"),
        (math.log(4.0), "4 : 1 for"),
        (-math.log(2.5), "2.5 : 1 against"),
        (math.log(16.2), "16 : 1 for"),
        (-50.0, "over 1000 : 1 against"),
        (math.inf, "over 1000 : 1 for"),
        (math.nan, "neutral"),
    ],
)
def test_odds_in_words(weight, text):
    assert odds(weight) == text


def nowhere(**changes) -> Gap:
    return Gap(**({"before": math.nan, "refit": math.nan, "after": math.nan} | changes), noise=math.nan,
               unit="rad", variation=math.nan)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "evidence", [None, Evidence(), Evidence(laws=[law()], stages=[stage(math.nan, math.nan)])]
)
def test_gaps_that_are_no_numbers_and_evidence_that_is_not_there_are_told_too(kind, evidence, tmp_path):
    whole = KINDS[kind].model_copy(update={"held": HeldOutEvidence(slope=math.nan, spread=math.inf)})
    found = told(whole, gap={"output_angle": nowhere(), "motor_torque": nowhere(before=1.0, after=0.5)})
    found = type(found)(found.verdict, whole if evidence is None else evidence)
    text = page(found, tmp_path)
    assert "not known" in text
    shown = re.sub(r"<style>.*?</style>|base64,[^']*", "", text)
    assert not re.search(r"\bnan\b|\binf\b", shown)
    terminal = Console(width=80, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show(found, terminal)
    assert not re.search(r"\bnan\b|\binf\b", terminal.export_text())


def test_without_held_out_data_there_is_no_gap(tmp_path):
    text = page(told(EFFECT, gap={}), tmp_path)
    assert "No data were held out" in text
    assert not (tmp_path / "gap.png").exists()
