"""Names, numbers and units, as they are written for readers who do not know hdsim."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from hdsim.diagnosis.verdict import IdentifiedEffect
from hdsim.estimate.found import Gap, ParameterEstimate, ShortCut
from hdsim.plot import units
from hdsim.scenario.fields import split_unit

#: Said beside numbers that held-out data helped to estimate.
FROM_ALL_DATA = (
    "Estimated from all data after the validation, held-out stretches included; the residuals are of the "
    "estimates from the training data."
)
#: Said where they could not.
NOT_FROM_ALL_DATA = (
    "--all-data: the estimates stay those of the training data, as beside an unidentified effect, or "
    "where no prediction follows all data."
)
#: What stands where a number is not known.
UNKNOWN = "not known"
#: Standard deviations in a 95 % interval, from end to end; intervals are made of two to each side.
_INTERVAL = 4.0
#: Odds beyond which they are only said to be large.
LARGE_ODDS = 1000.0
#: Words of names that are written with capital letters.
_PROPER = {
    "coulomb": "Coulomb",
    "stribeck": "Stribeck",
    "lugre": "LuGre",
    "maxwell": "Maxwell",
    "duhem": "Duhem",
}
_PROPER |= {"k1": "K1", "k2": "K2", "k3": "K3", "t1": "T1", "t2": "T2"}
#: The field's terms for parameters of drive and load, by their path without the unit.
_PARAMETERS = {
    "drive.inertia.motor": "motor inertia",
    "drive.inertia.wave_generator": "wave-generator inertia",
    "drive.friction.coulomb": "Coulomb friction",
    "drive.friction.viscous": "viscous friction",
    "drive.friction.load_coefficient": "load coefficient of friction",
    "drive.torsion.stiffness_k1": "torsional stiffness K1",
    "drive.torsion.stiffness_k2": "torsional stiffness K2",
    "drive.torsion.stiffness_k3": "torsional stiffness K3",
    "drive.torsion.torque_t1": "knee torque T1",
    "drive.torsion.torque_t2": "knee torque T2",
    "drive.torsion.damping": "torsional damping",
    "load.inertia": "load inertia",
    "load.gravity.mass": "load mass",
    "load.arm.payload.mass": "payload mass",
    "load.arm.payload.lever": "payload lever",
    "load.arm.mass_factor": "mass factor of the arm",
}


def spoken(name: str) -> str:
    """A name of the program as words."""
    return " ".join(_PROPER.get(word, word) for word in name.replace("_", " ").split(" "))


def started(sentence: str) -> str:
    """With a capital letter at its start."""
    return sentence[:1].upper() + sentence[1:]


def shown(value: float) -> str:
    """A number with four digits, without an exponent as long as it stays readable."""
    if not math.isfinite(value):
        return UNKNOWN
    if value == 0:
        return "0"
    if 1e-3 <= abs(value) < 1e6:
        digits = max(0, 3 - math.floor(math.log10(abs(value))))
        text = f"{value:.{digits}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, _, exponent = f"{value:.3e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"


def short(value: float, digits: int = 3) -> str:
    """A number with few digits; ``UNKNOWN`` for what is not finite."""
    return f"{value:.{digits}g}" if math.isfinite(value) else UNKNOWN


def times(value: float) -> str:
    """A ratio as a multiple, with a decimal where it is significant: ``1.4 times``."""
    return f"{value:.1f} times" if abs(value) < 9.95 else f"{short(value)} times"


def percent(share: float) -> str:
    """A share in percent; above 99.5 % it is given as a bound, as resampling resolves no more."""
    if not math.isfinite(share):
        return UNKNOWN
    return "over 99\u00a0%" if share > 0.995 else f"{100 * share:.0f}\u00a0%"


def short_cut_words(short_cut: ShortCut) -> str:
    """How predictions with teeth were made, and how far from the whole model that is."""
    far = ", ".join(f"{spoken(c)} {100 * part:.2g}\u00a0%" for c, part in short_cut.error.items())
    if not short_cut.taken:
        return (
            "All predictions are those of the whole model, every tooth and the ring. A table of the teeth "
            f"without the ring's own vibration would have been off by too much of the noise: {far}."
        )
    return (
        "Fits predicted the teeth from a table and left out their ring's own vibration. What that does to "
        f"the final model's predictions, as a part of the noise: {far}. The proof rests on the whole model."
    )


def below(chance: float) -> str:
    """A probability in percent; below 0.5 % it is given as a bound, as the draws resolve no less."""
    if not math.isfinite(chance):
        return UNKNOWN
    said = f"{100 * chance:.0f}" if chance >= 0.1 else f"{100 * chance:.2g}"
    return f"less than {said}\u00a0%" if chance <= 0.005 else f"{said}\u00a0%"


def of_ten(probability: float) -> str:
    """A probability as a count out of ten, or of more where ten are too coarse: ``9 in 10``."""
    if not math.isfinite(probability):
        return UNKNOWN
    if probability >= 0.99:
        return "over 99 in 100"
    return next(
        f"{round(many * probability)} in {many}"
        for many in (10, 20, 50, 100)
        if round(many * probability) < many or many == 100
    )


def odds(weight: float) -> str:
    """Log odds as a factor: ``12 : 1 for``, ``3 : 1 against``."""
    factor = math.exp(min(abs(weight), 700.0))
    if not factor >= 1.05:
        return "neutral"
    side = "for" if weight > 0 else "against"
    many = f"over {LARGE_ODDS:.0f}" if factor > LARGE_ODDS else f"{factor:.{0 if factor >= 9.95 else 1}f}"
    return f"{many.removesuffix('.0')} : 1 {side}"


def named_number(path: str, settings: Mapping[str, Any] | None = None) -> tuple[str, str]:
    """Name and unit of a parameter by its path: ``drive.friction.coulomb_nm`` is Coulomb friction in N m.

    Args:
        path: dotted path.
        settings: of the effect, where the path leads into one; they tell the orders of harmonics.
    """
    parts = path.split(".")
    last, unit = split_unit(parts[-1])
    term = _PARAMETERS.get(".".join([*parts[:-1], last.replace(" ", "_")]))
    if term is not None:
        return term, units.printed(unit)
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
    return ", ".join([*sections, spoken(last)]), units.printed(unit)


def unit_of(gap: Gap) -> units.Unit:
    """The unit in which a held-out residual is readable; it is stored in SI units."""
    if gap.unit == "rad":
        return units.for_error(gap.before)
    return units.for_torque(gap.before) if gap.unit == "N m" else units.Unit(gap.unit, 1.0)


def title_of(name: str) -> str:
    """The field's term for an effect of the catalogue; any other name is spoken."""
    from hdsim.effects import catalogue

    known = catalogue()
    return known[name].title if name in known else spoken(name)


def titles_of(effect: IdentifiedEffect) -> list[str]:
    """The effect's title, and the titles of those that the data cannot distinguish from it."""
    return [effect.title or spoken(effect.name), *map(title_of, effect.indistinguishable_from)]


def standard_errors(number: ParameterEstimate) -> float:
    """Distance of an estimate from the model's value."""
    if number.interval is None or number.start is None:
        return 0.0
    low, high = number.interval
    if number.start > 0 and number.value > 0 and low > 0:
        # Parameters of the model are estimated by their logarithm.
        spread = math.log(high / low) / _INTERVAL
        return abs(math.log(number.value / number.start)) / spread if spread > 0 else math.inf
    spread = (high - low) / _INTERVAL
    return abs(number.value - number.start) / spread if spread > 0 else math.inf
