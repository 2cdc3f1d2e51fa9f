"""A verdict in words for readers who have never seen hdsim: how sure it is, what it means, what it gains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hdsim.diagnose.name import LEVEL
from hdsim.diagnose.verdict import NamedEffect, Verdict
from hdsim.estimate.found import FittedNumber, Gap
from hdsim.plot import units
from hdsim.scenario.fields import split_unit

if TYPE_CHECKING:
    from hdsim.diagnose.workflow import Diagnosis

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
    "unknown": "A pattern is left that repeats, and no known effect explains it well enough to be named: "
    "better no name than a wrong one.",
}
#: Words for the share of resampled records in which the same name wins, from the highest down.
_SURE = ((0.95, "Very sure"), (0.8, "Sure"), (0.6, "Fairly sure"), (0.0, "Not sure"))
#: Words for how many standard errors the number that moved farthest lies from the model's.
_FAR = ((6.0, "Very sure"), (3.5, "Sure"), (0.0, "Fairly sure"))
#: Standard deviations in a 95 % interval, from end to end; intervals are made of two to each side.
_INTERVAL = 4.0

#: How a unit is printed where it is not as scenarios write it.
_PRINTED = {"degC": "°C", "um": "µm", "^2": "²", "^3": "³"}


@dataclass(frozen=True)
class Sureness:
    """How sure a verdict is: in a word or two, as a number, and what the number is."""

    words: str
    number: str
    details: tuple[str, ...]


def meaning(verdict: Verdict) -> str:
    """What a verdict means for the reader's model."""
    if verdict.remainder is not None:
        return (
            "Something acts that the model does not have, perhaps once only: a shock, a slip, a stop that "
            "the motion reached a single time. What does not repeat cannot be tested, so it gets no name; a "
            "record in which it happens again would tell more."
        )
    said = MEANINGS[verdict.verdict]
    if verdict.verdict == "unknown":
        said += (
            " Instead it is given as a curve, which found.yaml adds to the model."
            if verdict.curve is not None
            else " No curve over a single quantity holds on unseen data; the pictures show where it is."
        )
    return said


def spoken(name: str) -> str:
    """A name of the program as words."""
    return name.replace("_", " ")


def shown(value: float) -> str:
    """A number with four digits, without an exponent as long as it stays readable."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    if 1e-3 <= abs(value) < 1e6:
        digits = max(0, 3 - math.floor(math.log10(abs(value))))
        text = f"{value:.{digits}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, _, exponent = f"{value:.3e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"


def named_number(path: str, settings: Mapping[str, Any] | None = None) -> tuple[str, str]:
    """Words and unit of a number by its path: ``drive.friction.coulomb_nm`` is friction, coulomb in N m.

    Args:
        path: dotted path.
        settings: of the effect, where the path leads into one; they tell the orders of harmonics.
    """
    parts = path.split(".")
    last, unit = split_unit(parts[-1])
    for plain, printed in _PRINTED.items():
        unit = unit.replace(plain, printed)
    sections: list[str] = []
    here: Any = settings
    for part in parts[:-1]:
        try:
            here = here[int(part) if part.isdigit() else part] if here is not None else None
        except (KeyError, IndexError, TypeError):
            here = None
        if part.isdigit() and isinstance(here, Mapping) and "order" in here:
            # The order tells more than the name of the list and the place in it.
            turn = f" per {spoken(here['per'])}" if here.get("per") else ""
            sections[-1:] = [f"order {here['order']:g}{turn}"]
        elif part != "drive":
            sections.append(f"no. {int(part) + 1}" if part.isdigit() else spoken(part))
    return ", ".join([*sections, last]), unit


def unit_of(gap: Gap) -> units.Unit:
    """The unit in which a gap is readable; gaps are stored in SI units."""
    if gap.unit == "rad":
        return units.for_error(gap.before)
    return units.for_torque(gap.before) if gap.unit == "N m" else units.Unit(gap.unit, 1.0)


def title_of(name: str) -> str:
    """The field's term for an effect of the catalogue."""
    from hdsim.effects import catalogue

    known = catalogue()
    return known[name].title if name in known else spoken(name)


def titles_of(effect: NamedEffect) -> list[str]:
    """The effect's title, and the titles of those that it cannot be told from."""
    return [effect.title or spoken(effect.name), *map(title_of, effect.indistinguishable_from)]


def headline(verdict: Verdict) -> str:
    """The verdict's sentence for a heading: numbers by words instead of paths, alternatives side by side."""
    sentence = verdict.sentence
    if verdict.verdict == "effect" and any(effect.indistinguishable_from for effect in verdict.effects):
        parts = []
        for effect in verdict.effects:
            titles = titles_of(effect)
            parts.append(" or ".join(titles) + (" (these data cannot tell which)" if len(titles) > 1 else ""))
        said = f"The model is missing {'; and '.join(parts)}."
    elif verdict.verdict == "parameter":
        if _unsure(verdict):
            names = [named_number(name)[0] for name in verdict.moved]
            said = "No effect is missing; a number of the model is off, "
            said += (
                f"most simply {names[0]} (it would explain most of it alone)."
                if len(names) == 1
                else f"and these data leave open which: {'; '.join(names)} (each would explain most alone)."
            )
        else:
            said = f"No effect is missing; {len(verdict.moved)} numbers of the model are off: "
            said = said.replace("1 numbers of the model are", "one number of the model is")
            said += ", ".join(_change(name, verdict.parameters[name]) for name in verdict.moved) + "."
    else:
        for channel in verdict.gap:
            sentence = sentence.replace(channel, spoken(channel))
        return sentence.replace("is a function of frequency", "is vibration that the motion shakes up")
    # What is to be checked first stays first.
    doubt = sentence.partition("Check the data first: ")[2]
    return f"Check the data first (below). {said}" if doubt else said


def _unsure(verdict: Verdict) -> bool:
    """Whether some number is off, but no interval excludes the model's."""
    numbers = [verdict.parameters[name] for name in verdict.moved]
    return all(
        n.interval is None or (n.start is not None and n.interval[0] <= n.start <= n.interval[1])
        for n in numbers
    )


def _change(name: str, number: FittedNumber) -> str:
    words, unit = named_number(name)
    start = "" if number.start is None else f" instead of {shown(number.start)}"
    return f"{words} {shown(number.value)}{start} {unit}".rstrip()


def sureness(diagnosis: Diagnosis) -> Sureness:
    """How sure a diagnosis is."""
    verdict = diagnosis.verdict
    search = [stage.screening for stage in diagnosis.stages if stage.screening is not None]
    last = search[-1].chance if search else 1.0
    if verdict.verdict == "effect":
        return _of_effects(verdict.effects)
    if verdict.remainder is not None:
        number = f"{verdict.remainder.times_noise:.2g} times the noise"
        said = ["Noise alone leaves every stretch of a record at about its own level."]
        return Sureness("Sure that something is missing, not what", number, tuple(said))
    if verdict.verdict == "unknown":
        chance = min(stage.location.chance for stage in diagnosis.stages)
        share = max(stage.location.structured for stage in diagnosis.stages)
        said = [
            f"The chance to see so much of a pattern in pure noise is {below(chance)}.",
            f"{percent(share)} of what the model leaves, weighed by the noise, is that pattern; the named "
            "effects explain too little of it.",
        ]
        return Sureness("Sure that something is missing, not what", f"{below(chance)} by chance", tuple(said))
    if last <= LEVEL:
        nothing_more = (
            f"An effect of the catalogue explains more than chance does ({below(last)}), but too little, or "
            "not when fitted in full, to be named."
        )
    else:
        nothing_more = (
            "Where nothing is missing, some effect of the catalogue looks as good as the best one here in "
            f"{percent(last)} of cases (one is named only below {percent(LEVEL)})."
            if search and search[-1].ranked
            else "No effect of the catalogue could be tried on these data."
        )
    if verdict.verdict == "parameter" and _unsure(verdict):
        fall = min(gap.refit / gap.before for gap in verdict.gap.values() if gap.before > 0)
        said = ["No interval excludes the model's number, the gap does: numbers stand in for one another."]
        said.append(nothing_more)
        words = "Sure that a number is off, not which"
        return Sureness(words, f"the re-fit lets a gap fall to {percent(fall)}", tuple(said))
    if verdict.verdict == "parameter":
        far = farthest(verdict)
        number = f"{far:.2g} standard errors" if far < 100 else "over 100 standard errors"
        said = [f"The number that moved farthest lies {number} from the model's.", nothing_more]
        return Sureness(_word(_FAR, far), number, tuple(said))
    ratios = [gap.after / gap.noise for gap in verdict.gap.values() if gap.noise > 0]
    worst = max(ratios, default=math.nan)
    words = "No sign of anything missing" if last > LEVEL else "Nothing that can be named"
    number = f"{worst:.2g} times the noise is left" if ratios else f"{percent(last)} by chance"
    return Sureness(words, number, (nothing_more,))


def _of_effects(effects: Sequence[NamedEffect]) -> Sureness:
    weakest = min(effects, key=lambda effect: effect.confidence)
    words = _word(_SURE, weakest.confidence)
    groups = [titles_of(effect) for effect in effects if effect.indistinguishable_from]
    if groups:
        words += (
            " that it is one of these, not which" if len(effects) == 1 else ", up to the alternatives given"
        )
    if len(effects) == 1:
        who = "It or one of its group" if groups else "It"
        said = [
            f"{who} is the best explanation in {percent(weakest.confidence)} of resampled records.",
            f"Where nothing is missing, the whole search finds as much in {below(weakest.chance)} of cases.",
        ]
        return Sureness(words, percent(weakest.confidence), tuple(said))
    said = [
        f"{effect.title or spoken(effect.name)}: best in {percent(effect.confidence)} of resampled records; "
        f"by chance in {below(effect.chance)}."
        for effect in effects
    ]
    said.append("By chance: how often the whole search finds as much where nothing is missing.")
    return Sureness(words, percent(weakest.confidence), tuple(said))


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
        before, after, noise = (f"{unit.factor * v:.3g}" for v in (gap.before, gap.after, gap.noise))
        change = f"{before} → {after} {unit.name}" if before != after else f"stays at {after} {unit.name}"
        fall = 100 * (gap.after / gap.before - 1) if gap.before > 0 else 0.0
        change += f" ({fall:+.0f} %)" if abs(fall) >= 0.5 else ""
        said.append(f"{spoken(channel)}: {change}; noise {noise}".replace("(-", "(−"))
    return said


def _word(words: Sequence[tuple[float, str]], value: float) -> str:
    return next(word for least, word in words if value >= least)


def percent(share: float) -> str:
    """A share in percent; what resampling cannot tell from all is not called all."""
    return "over 99\u00a0%" if share > 0.995 else f"{100 * share:.0f}\u00a0%"


def below(chance: float) -> str:
    """A probability in percent; what so many draws cannot tell from zero is said as a bound."""
    return f"less than {100 * chance:.2g}\u00a0%" if chance <= 0.005 else f"{100 * chance:.2g}\u00a0%"
