"""A verdict as text: headline, confidence, meaning, validation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.screen import LEVEL
from hdsim.diagnosis.verdict import IdentifiedEffect, Verdict
from hdsim.estimate.found import ParameterEstimate
from hdsim.tell.because import weighings
from hdsim.tell.findings import Findings
from hdsim.tell.words import (
    below,
    named_number,
    of_ten,
    percent,
    short,
    shown,
    spoken,
    standard_errors,
    started,
    times,
    title_of,
    titles_of,
    unit_of,
)

KINDS = {
    "nothing": "Nothing is missing",
    "parameter": "Parameters of the model are wrong",
    "effect": "The model is missing an effect",
    "unknown": "An unidentified effect is missing",
}
MEANINGS = {
    "nothing": "The model explains these data: its residual cannot be distinguished from noise. Effects that "
    "are too weak to be detected here, or not excited by this motion, may still be there.",
    "parameter": "The structure of the model is right, but some of its parameters do not fit this machine. "
    "With the estimates below, no further effect is detected.",
    "effect": "A physical effect that the model does not include explains a residual that no change of the "
    "model's parameters explains. The scenario found.yaml adds it, with estimated parameters.",
    "unknown": "The residual is systematic, but no known effect is probable enough to be identified as its "
    "cause.",
}
#: Words for the probability that an identified effect is right, from the highest down.
SURE = ((0.95, "Very sure"), (0.8, "Sure"), (0.6, "Fairly sure"), (0.0, "Not sure"))
#: Words for the distance, in standard errors, of the estimate that moved farthest from the model's value.
_FAR = ((6.0, "Very sure"), (3.5, "Sure"), (0.0, "Fairly sure"))
#: Nothing is called very sure with more unexplained: times the noise, share of the systematic residual.
MUCH_NOISE, MUCH_STRUCTURE = 2.0, 0.1
#: How a sentence begins that a warning about the data leads.
DOUBT = "Check the data first: "


@dataclass(frozen=True)
class Sureness:
    """Confidence of a verdict: in a word or two, as a number, what that is; the residual, if it is large."""

    words: str
    number: str
    details: tuple[str, ...] = ()
    left: str = ""

    @property
    def sentence(self) -> str:
        """All but the details."""
        return f"{self.words}: {self.number}.{f' But {self.left}.' if self.left else ''}"


def headline(found: Findings) -> str:
    """The verdict for a heading: names instead of paths, alternatives side by side."""
    verdict = found.verdict
    if verdict.verdict == "effect":
        said = _missing(found)
    elif verdict.verdict == "parameter":
        said = _off(verdict)
    elif verdict.verdict == "unknown":
        said = _without_a_name(found)
    else:
        said = "The data show no effect that is missing from the model."
    return f"Check the data first (below). {said}" if verdict.sentence.startswith(DOUBT) else said


def _missing(found: Findings) -> str:
    parts = []
    for effect in found.verdict.effects:
        titles = titles_of(effect)
        parts.append(
            " or ".join(titles) + (" (not distinguishable with these data)" if len(titles) > 1 else "")
        )
    return f"The model is missing {'; and '.join(parts)}.{other_shape(found)}"


def other_shape(found: Findings) -> str:
    """The residual of the identified effects, as a sentence; empty where that may be chance."""
    rest = found.verdict.remains
    if rest is None:
        return ""
    share, over = percent(rest.share), spoken(rest.coordinate)
    return f" {share} of the systematic residual remains, a function of the {over}."


def _off(verdict: Verdict) -> str:
    if _unsure(verdict):
        names = [named_number(name)[0] for name in verdict.moved]
        return "No effect is missing; a parameter of the model is wrong, " + (
            f"most simply {names[0]} (it explains most of the residual alone)."
            if len(names) == 1
            else f"one of: {'; '.join(names)} (each explains most of the residual alone)."
        )
    many = len(verdict.moved)
    count = (
        "one parameter of the model is wrong" if many == 1 else f"{many} parameters of the model are wrong"
    )
    changes = (changed(name, number) for name, number in verdict.moved_parameters.items())
    return f"No effect is missing; {count}: {', '.join(changes)}."


def _without_a_name(found: Findings) -> str:
    rest, stage = found.once, found.strongest
    if rest is not None:
        where = (
            f"The residual of {spoken(rest.channel)} in {rest.record} reaches {times(rest.times_noise)} the "
            f"noise, mostly between {short(rest.start_s)} and {short(rest.end_s)} s, and depends on no "
            "measured "
            "quantity repeatably"
        )
    elif stage is not None and stage.places:
        place = stage.places[0]
        what = f"a function of {spoken(place.coordinate)}"
        what = "vibration excited by the motion" if place.coordinate == "frequency" else what
        where = f"{percent(place.share)} of the residual of {spoken(place.channel)} is {what}"
    else:
        return "The residual is systematic, and no known effect is probable enough to be its cause."
    near = nearest(found)
    if near:
        return f"{where}. Closest: {near}, too little to be identified."
    return f"{where}. No known effect comes close."


def nearest(found: Findings) -> str:
    """The effects that explain most, and how much; empty where none was fitted."""
    names, share = found.nearest
    if not names:
        return ""
    verb = "explains" if len(names) == 1 else "together explain"
    return f"{' and '.join(map(title_of, names))}, which {verb} {percent(share)} of the systematic residual"


def meaning(found: Findings) -> str:
    """What a verdict means for the model."""
    verdict = found.verdict
    if found.once is not None:
        return (
            "An effect acts that the model does not include, perhaps once only: a shock, a slip, an end stop "
            "that the motion reached a single time. What does not repeat cannot be identified; a record in "
            "which it occurs again would help."
        )
    said = MEANINGS[verdict.verdict]
    if verdict.verdict == "effect" and verdict.remains is not None:
        said += " Its equation is not exact, or something beside it is missing: what remains is shown below"
        said += (
            " and not part of found.yaml; found_with_curve.yaml has it as a curve."
            if verdict.scenario_with_curve
            else " and not part of found.yaml."
        )
    if verdict.teeth is not None:
        said = " ".join([said, *verdict.teeth.sentences])
        if verdict.teeth.scenario:
            said += " That drive is written as toothed.yaml."
    if verdict.verdict == "unknown":
        said += (
            " It is estimated as a curve instead, which found.yaml adds to the model."
            if verdict.curve is not None
            else " No curve over a single regressor holds on held-out data; see what the residual depends on."
        )
    return said


def _unsure(verdict: Verdict) -> bool:
    """Whether some parameter is wrong, but no interval excludes the model's value."""
    return all(
        n.interval is None or (n.start is not None and n.interval[0] <= n.start <= n.interval[1])
        for n in verdict.moved_parameters.values()
    )


def changed(name: str, number: ParameterEstimate) -> str:
    """A parameter with its new value and the old one."""
    words, unit = named_number(name)
    start = "" if number.start is None else f" instead of {shown(number.start)}"
    return f"{words} {shown(number.value)}{start} {unit}".rstrip()


def sureness(found: Findings) -> Sureness:
    """The confidence of a diagnosis."""
    verdict = found.verdict
    if verdict.verdict == "effect":
        return _of_effects(found)
    if verdict.verdict == "unknown":
        return _of_the_unknown(found)
    more = _nothing_more(found)
    if verdict.verdict == "parameter" and _unsure(verdict):
        falls = [g.refit / g.before for g in verdict.gap.values() if g.before > 0 and math.isfinite(g.refit)]
        said = (
            "None of their intervals excludes the model's value, but the residual does: they are confounded."
        )
        number = f"the re-fit reduces a held-out residual to {percent(min(falls, default=math.nan))}"
        return Sureness("Sure that a parameter is wrong, not which", number, (said, more))
    if verdict.verdict == "parameter":
        far = farthest(verdict)
        number = f"{far:.2g} standard errors" if far < 100 else "over 100 standard errors"
        said = f"The estimate that moved farthest differs by {number} from the model's value."
        return _capped(Sureness(_word(_FAR, far), number, (said, more)), found)
    ratios = [gap.after / gap.noise for gap in verdict.gap.values() if gap.noise > 0]
    worst = max(ratios, default=math.nan)
    words = "Nothing missing is detected" if found.search_chance > LEVEL else "No effect can be identified"
    if math.isfinite(worst):
        return Sureness(words, f"the held-out residual is {times(worst)} the noise", (more,))
    return Sureness(words, f"p-value {percent(found.search_chance)}", (more,))


def _nothing_more(found: Findings) -> str:
    chance = found.search_chance
    if chance <= LEVEL:
        return (
            f"An effect of the catalogue explains more than chance (p-value {below(chance)}), but too "
            "little, "
            "or not when fitted in full, to be identified."
        )
    if chance > 0.995:
        return "No effect of the catalogue explains more than chance does."
    return (
        "p-value of the whole search: where nothing is missing, the best effect of the catalogue explains as "
        f"much in {percent(chance)} of cases (significance level {percent(LEVEL)})."
    )


def much_left(found: Findings) -> str:
    """The unexplained residual, where it is too large to call anything very sure; empty else."""
    said = []
    record, channel, most = found.left_most
    if most > MUCH_NOISE:
        said.append(f"{times(most)} the noise of the {spoken(channel)} in {record}")
    if found.unexplained > MUCH_STRUCTURE:
        said.append(f"{percent(found.unexplained)} of the systematic residual")
    return " and ".join(said) + (" remains" if len(said) == 1 else " remain") if said else ""


def _capped(sure: Sureness, found: Findings) -> Sureness:
    """With the unexplained residual, where that is large; then nothing is very sure."""
    left = much_left(found)
    return replace(sure, words=sure.words.replace("Very sure", "Sure"), left=left) if left else sure


def _of_effects(found: Findings) -> Sureness:
    effects = found.verdict.effects
    least = min((effect.confidence for effect in effects), default=0.0)
    words = _word(SURE, least)
    grouped = any(effect.indistinguishable_from for effect in effects)
    if grouped:
        words += (
            " that it is one of these, not which" if len(effects) == 1 else ", up to the alternatives given"
        )
    chance = below(max((effect.chance for effect in effects), default=1.0))
    by_chance = f"p-value: where nothing is missing, the whole search finds as much in {chance} of cases."
    said = [by_chance]
    if len(effects) > 1:
        said = [
            f"{started(_title(one))}: {of_ten(one.confidence)} of such identifications are right."
            for one in effects
        ]
        said.append(by_chance)
    number = f"{of_ten(least)} of such {'verdicts' if len(effects) == 1 else 'identifications'} are right"
    return _capped(Sureness(words, number, tuple(said)), found)


def _title(effect: IdentifiedEffect) -> str:
    return effect.title or spoken(effect.name)


def _of_the_unknown(found: Findings) -> Sureness:
    words = "Sure that something is missing, not what"
    rest, stage = found.once, found.strongest
    said: list[str] = []
    likely = max((one.probability for one in weighings(found.verdict.because)), default=math.nan)
    if math.isfinite(likely):
        said.append(
            f"The most probable effect is right in {of_ten(likely)} cases; one is identified from "
            f"{of_ten(RULES.believed)}."
        )
    if rest is not None:
        said.insert(
            0, "From noise alone the residual would be at the noise level in every stretch of a record."
        )
        return Sureness(words, f"a residual of {times(rest.times_noise)} the noise", tuple(said))
    chance = found.evidence.pattern_chance
    if stage is not None:
        said.insert(
            0,
            f"p-value: noise alone shows as strong a pattern in {below(chance)} of cases; "
            f"{percent(stage.structured)} of the residual, weighted by the noise, is systematic.",
        )
    most = found.left_most[2]
    if chance > RULES.chance and most > RULES.rest:
        return Sureness(words, f"the residual is {times(most)} the noise", tuple(said))
    if chance > RULES.chance:
        words = "Not sure that anything is missing"
    return Sureness(words, f"p-value {below(chance)}", tuple(said))


def farthest(verdict: Verdict) -> float:
    """Distance of the estimate that moved farthest from the model's value, in standard errors."""
    return max(map(standard_errors, verdict.moved_parameters.values()), default=0.0)


def gains(verdict: Verdict) -> list[str]:
    """A sentence for each channel: its held-out RMS residual before and after."""
    said = []
    for channel, gap in verdict.gap.items():
        unit = unit_of(gap)
        before, after, noise = (short(unit.factor * v) for v in (gap.before, gap.after, gap.noise))
        change = f"{before} → {after} {unit.name}" if before != after else f"stays at {after} {unit.name}"
        fall = 100 * (gap.after / gap.before - 1) if gap.before > 0 else 0.0
        change += f" ({fall:+.0f} %)" if abs(fall) >= 0.5 else ""
        said.append(f"{spoken(channel)}: {change}; noise {noise}".replace("(-", "(−"))
    return said


def _word(words: Sequence[tuple[float, str]], value: float) -> str:
    return next((word for least, word in words if value >= least), words[-1][1])
