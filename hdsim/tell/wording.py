"""A verdict in words: what was found, how sure it is, what it means, what it gains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.screen import LEVEL
from hdsim.diagnosis.verdict import NamedEffect, Verdict
from hdsim.estimate.found import FittedNumber
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
    started,
    times,
    title_of,
    titles_of,
    unit_of,
)

KINDS = {
    "nothing": "Nothing is missing",
    "parameter": "Numbers of the model are off",
    "effect": "The model is missing an effect",
    "unknown": "Something without a name is missing",
}
MEANINGS = {
    "nothing": "The model has all that these data show: what it does not predict looks like noise. Effects "
    "too weak to be seen here, or not excited by this motion, may still be there.",
    "parameter": "The model has the right parts, but some of its numbers do not fit this machine. With the "
    "fitted numbers below, no further effect is seen.",
    "effect": "A known physical effect that the model does not have explains what no change of the model's "
    "own numbers can. It is added, with fitted numbers, in found.yaml.",
    "unknown": "Something acts that the model does not have, and no known effect is likely enough to be it: "
    "better no name than a wrong one.",
}
#: Words for the probability that a name is right, from the highest down.
SURE = ((0.95, "Very sure"), (0.8, "Sure"), (0.6, "Fairly sure"), (0.0, "Not sure"))
#: Words for how many standard errors the number that moved farthest lies from the model's.
_FAR = ((6.0, "Very sure"), (3.5, "Sure"), (0.0, "Fairly sure"))
#: Nothing is called very sure while more than this is left: times the noise, part of the structure.
MUCH_NOISE, MUCH_STRUCTURE = 2.0, 0.1
#: Standard deviations in a 95 % interval, from end to end; intervals are made of two to each side.
_INTERVAL = 4.0
#: How a sentence begins that a warning about the data leads.
DOUBT = "Check the data first: "


@dataclass(frozen=True)
class Sureness:
    """How sure a verdict is: in a word or two, as a number, what that is; what is left, if it is much."""

    words: str
    number: str
    details: tuple[str, ...] = ()
    left: str = ""

    @property
    def sentence(self) -> str:
        """All but the details."""
        return f"{self.words}: {self.number}.{f' But {self.left}.' if self.left else ''}"


def headline(found: Findings) -> str:
    """The verdict for a heading: numbers by words instead of paths, alternatives side by side."""
    verdict = found.verdict
    if verdict.verdict == "effect":
        said = _missing(found)
    elif verdict.verdict == "parameter":
        said = _off(verdict)
    elif verdict.verdict == "unknown":
        said = _without_a_name(found)
    else:
        said = "The data show nothing that the model lacks."
    return f"Check the data first (below). {said}" if verdict.sentence.startswith(DOUBT) else said


def _missing(found: Findings) -> str:
    parts = []
    for effect in found.verdict.effects:
        titles = titles_of(effect)
        parts.append(" or ".join(titles) + (" (these data cannot tell which)" if len(titles) > 1 else ""))
    return f"The model is missing {'; and '.join(parts)}.{other_shape(found)}"


def other_shape(found: Findings) -> str:
    """What the names leave, as a sentence; empty where that may be chance."""
    rest = found.other_shape
    if rest is None:
        return ""
    return (
        f" {percent(rest[0])} of the structure follows another shape, over the {spoken(rest[1].coordinate)}."
    )


def _off(verdict: Verdict) -> str:
    if _unsure(verdict):
        names = [named_number(name)[0] for name in verdict.moved]
        return "No effect is missing; a number of the model is off, " + (
            f"most simply {names[0]} (it would explain most of it alone)."
            if len(names) == 1
            else f"and these data leave open which: {'; '.join(names)} (each would explain most alone)."
        )
    many = len(verdict.moved)
    count = "one number of the model is off" if many == 1 else f"{many} numbers of the model are off"
    changes = (
        _change(name, verdict.parameters[name]) for name in verdict.moved if name in verdict.parameters
    )
    return f"No effect is missing; {count}: {', '.join(changes)}."


def _without_a_name(found: Findings) -> str:
    rest, stage = found.once, found.strongest
    if rest is not None:
        where = (
            f"{started(spoken(rest.channel))} of {rest.record} is left with up to "
            f"{times(rest.times_noise)} its noise, most of it between {short(rest.start_s)} and "
            f"{short(rest.end_s)} s, and follows nothing that these data repeat"
        )
    elif stage is not None and stage.places:
        place = stage.places[0]
        what = f"a function of {spoken(place.coordinate)}"
        what = "vibration that the motion shakes up" if place.coordinate == "frequency" else what
        where = f"{percent(place.share)} of what is left of {spoken(place.channel)} is {what}"
    else:
        return "Something is missing that no known effect is likely enough to be."
    near = nearest(found)
    if near:
        return f"{where}. Nearest: {near}, not enough like it to be named."
    return f"{where}. No known effect comes near."


def nearest(found: Findings) -> str:
    """The effects that explain most, and how much; empty where none was fitted."""
    names, share = found.nearest
    if not names:
        return ""
    verb = "explains" if len(names) == 1 else "together explain"
    return f"{' and '.join(map(title_of, names))}, which {verb} {percent(share)} of the structure"


def meaning(found: Findings) -> str:
    """What a verdict means for the reader's model."""
    verdict = found.verdict
    if found.once is not None:
        return (
            "Something acts that the model does not have, perhaps once only: a shock, a slip, a stop that "
            "the motion reached a single time. What does not repeat cannot be tested, so it gets no name; a "
            "record in which it happens again would tell more."
        )
    said = MEANINGS[verdict.verdict]
    if verdict.verdict == "effect" and found.other_shape is not None:
        said += " No formula is exact: what it leaves of its own shape is said below, and not in found.yaml."
    if verdict.teeth is not None:
        said = " ".join([said, *verdict.teeth.sentences])
        if verdict.teeth.scenario:
            said += " That drive is written as toothed.yaml."
    if verdict.verdict == "unknown":
        said += (
            " Instead it is given as a curve, which found.yaml adds to the model."
            if verdict.curve is not None
            else " No curve over a single quantity holds on unseen data; the pictures show where it is."
        )
    return said


def _unsure(verdict: Verdict) -> bool:
    """Whether some number is off, but no interval excludes the model's."""
    numbers = [verdict.parameters[name] for name in verdict.moved if name in verdict.parameters]
    return all(
        n.interval is None or (n.start is not None and n.interval[0] <= n.start <= n.interval[1])
        for n in numbers
    )


def _change(name: str, number: FittedNumber) -> str:
    words, unit = named_number(name)
    start = "" if number.start is None else f" instead of {shown(number.start)}"
    return f"{words} {shown(number.value)}{start} {unit}".rstrip()


def sureness(found: Findings) -> Sureness:
    """How sure a diagnosis is."""
    verdict = found.verdict
    if verdict.verdict == "effect":
        return _of_effects(found)
    if verdict.verdict == "unknown":
        return _of_the_unknown(found)
    more = _nothing_more(found)
    if verdict.verdict == "parameter" and _unsure(verdict):
        falls = [g.refit / g.before for g in verdict.gap.values() if g.before > 0 and math.isfinite(g.refit)]
        said = "No interval excludes the model's number, the gap does: numbers stand in for one another."
        number = f"the re-fit lets a gap fall to {percent(min(falls, default=math.nan))}"
        return Sureness("Sure that a number is off, not which", number, (said, more))
    if verdict.verdict == "parameter":
        far = farthest(verdict)
        number = f"{far:.2g} standard errors" if far < 100 else "over 100 standard errors"
        said = f"The number that moved farthest lies {number} from the model's."
        return _capped(Sureness(_word(_FAR, far), number, (said, more)), found)
    ratios = [gap.after / gap.noise for gap in verdict.gap.values() if gap.noise > 0]
    worst = max(ratios, default=math.nan)
    words = "No sign of anything missing" if found.search_chance > LEVEL else "Nothing that can be named"
    if math.isfinite(worst):
        return Sureness(words, f"{times(worst)} the noise is left", (more,))
    return Sureness(words, f"{percent(found.search_chance)} by chance", (more,))


def _nothing_more(found: Findings) -> str:
    chance = found.search_chance
    if chance <= LEVEL:
        return (
            f"An effect of the catalogue explains more than chance does ({below(chance)}), but too little, "
            "or not when fitted in full, to be named."
        )
    if chance > 0.995:
        return "No effect of the catalogue explains more than chance does."
    return (
        "Where nothing is missing, some effect of the catalogue looks as good as the best one here in "
        f"{percent(chance)} of cases (one is looked at only below {percent(LEVEL)})."
    )


def much_left(found: Findings) -> str:
    """What is left, where it is too much to call anything very sure; empty else."""
    said = []
    channel, most = found.left_most
    if most > MUCH_NOISE:
        said.append(f"{times(most)} the noise of the {spoken(channel)}")
    if found.unexplained > MUCH_STRUCTURE:
        said.append(f"{percent(found.unexplained)} of the structure")
    return " and ".join(said) + (" is left" if len(said) == 1 else " are left") if said else ""


def _capped(sure: Sureness, found: Findings) -> Sureness:
    """With what is left, where that is much; then nothing is very sure."""
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
    by_chance = f"Where nothing is missing, the whole search finds as much in {chance} of cases."
    said = [by_chance]
    if len(effects) > 1:
        said = [
            f"{started(_title(one))}: {of_ten(one.confidence)} of such names are right." for one in effects
        ]
        said.append(by_chance)
    number = f"{of_ten(least)} of such {'verdicts' if len(effects) == 1 else 'names'} are right"
    return _capped(Sureness(words, number, tuple(said)), found)


def _title(effect: NamedEffect) -> str:
    return effect.title or spoken(effect.name)


def _of_the_unknown(found: Findings) -> Sureness:
    words = "Sure that something is missing, not what"
    rest, stage = found.once, found.strongest
    said: list[str] = []
    likely = max((one.probability for one in weighings(found.verdict.because)), default=math.nan)
    if math.isfinite(likely):
        said.append(
            f"A name as likely as this is right in {of_ten(likely)} cases; one is given from "
            f"{of_ten(RULES.believed)}."
        )
    if rest is not None:
        said.insert(0, "Noise alone leaves every stretch of a record at about its own level.")
        return Sureness(words, f"{times(rest.times_noise)} the noise", tuple(said))
    chance = found.pattern_chance
    if stage is not None:
        said.insert(
            0,
            f"The chance to see so much of a pattern in pure noise is {below(chance)}; "
            f"{percent(stage.structured)} of what the model leaves, weighed by the noise, is that pattern.",
        )
    most = found.left_most[1]
    if chance > RULES.chance and most > RULES.rest:
        return Sureness(words, f"{times(most)} the noise is left", tuple(said))
    if chance > RULES.chance:
        words = "Not sure that anything is missing"
    return Sureness(words, f"{below(chance)} by chance", tuple(said))


def farthest(verdict: Verdict) -> float:
    """Distance of the fitted number that moved farthest from the model's, in standard errors."""
    found = [_distance(verdict.parameters[name]) for name in verdict.moved if name in verdict.parameters]
    return max(found, default=0.0)


def _distance(number: FittedNumber) -> float:
    if number.interval is None or number.start is None:
        return 0.0
    low, high = number.interval
    if number.start > 0 and number.value > 0 and low > 0:
        # Numbers of the model are fitted by their logarithm.
        spread = math.log(high / low) / _INTERVAL
        return abs(math.log(number.value / number.start)) / spread if spread > 0 else math.inf
    spread = (high - low) / _INTERVAL
    return abs(number.value - number.start) / spread if spread > 0 else math.inf


def gains(verdict: Verdict) -> list[str]:
    """A sentence for each channel: what the gap was and is."""
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
