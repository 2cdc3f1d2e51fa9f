"""What the names of columns say, in the words of the field: English, German and some others."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from hdsim.log.units import split_name, unit_of

#: Words by meaning. A name is cut into these; what is left over says nothing.
WORDS: dict[str, str] = {
    # quantities
    "time": "time zeit timestamp stamp uhrzeit zeitstempel datum date datetime temps tiempo tempo clock t",
    "angle": "angle angles position positions pos winkel drehwinkel lage theta phi q encoder enc "
    "drehgeber geber stellung winkellage posizione posicion angulo angolo inc increments "
    "resolver qpos",
    "velocity": "velocity velocities vel speed omega drehzahl geschwindigkeit winkelgeschwindigkeit "
    "dq qd qdot w vitesse velocidad velocita rpm dps qvel n",
    "acceleration": "acceleration accelerations accel acc qdd ddq beschleunigung winkelbeschleunigung",
    "torque": "torque torques trq tau moment momente drehmoment mom couple coppia par effort tq nm m",
    "current": "current currents curr cur strom stroeme iq amp amps ampere corrente corriente courant i",
    "temperature": "temperature temp temperatur temperaturen tcase temperatura",
    # sides
    "motor": "motor mot motors input inp in antrieb antriebs motorseite antriebsseite eingang wg "
    "wavegenerator wave generator rotor eingangs moteur primary",
    "output": "output out abtrieb abtriebs abtriebsseite joint joints gelenk gelenke link arm "
    "ausgang ausgangs flange flansch secondary achse achs axis axes lastseite",
    "load": "load last brake bremse bremsen external extern ext",
    # kinds
    "sensor": "sensor sm sensed measured meas mess gemessen ist istwert actual act real cell lc "
    "zelle messwelle dms transducer aufnehmer",
    "reference": "cmd cmptd command commanded commands target desired des ref reference setpoint soll "
    "sollwert demand demanded sp consigne goal control vorgabe fuehrung",
    "estimate": "model modell est estimate estimated calc calculated computed berechnet observer "
    "predicted sim simulated",
    "difference": "error errors err fehler abweichung deviation diff difference lag schlepp "
    "schleppfehler residual",
    "other": "state status fault mode flag nr number index idx id sample samples test cycle pose "
    "twist wrench force kraft voltage spannung volt u power leistung pressure humidity "
    "fts imu gravity",
    "housing": "housing case gehaeuse gear getriebe ambient",
    "winding": "winding wicklung coil stator",
    "d": "d",
}
_MEANING: dict[str, str] = {word: meaning for meaning, words in WORDS.items() for word in words.split()}
QUANTITIES = ("time", "angle", "velocity", "acceleration", "torque", "current", "temperature")
#: Letters beyond ASCII, as the words above spell them.
_LETTERS = {
    "ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "φ": " phi ", "ϕ": " phi ",
    "θ": " theta ", "ϑ": " theta ", "ω": " omega ", "τ": " tau ",
}  # fmt: skip
#: Joints between the parts of a German compound.
_LINKS = ("", "s", "es", "n", "en")


@dataclass(frozen=True)
class Meaning:
    """What a name says.

    Args:
        quantity: ``time``, ``angle``, ``velocity``, ``torque``, ``current``, ... or "".
        side: ``motor``, ``output``, ``load`` or "".
        marks: further meanings: sensor, reference, estimate, difference, other, current, ...
        stem: the name without its number, by which the columns of several axes belong together.
        axis: the number at its end, or None.
        unit: the unit that it states, or "".
    """

    quantity: str
    side: str
    marks: frozenset[str]
    stem: str
    axis: int | None
    unit: str

    @property
    def measured(self) -> bool:
        """Whether the name can be that of a measurement."""
        return not self.marks & {"reference", "estimate", "difference", "other"}


def meaning(name: str, stated: str = "") -> Meaning:
    """What a column's name says; ``stated`` is the unit that stands elsewhere, as in a row of units."""
    bare, in_name = split_name(name)
    unit = stated or in_name
    numbered = re.fullmatch(r"(.*?)[ _.\-\[]*(\d{1,2})\]?", bare)
    axis = int(numbered[2]) if numbered and numbered[1] else None
    stem = numbered[1] if numbered and numbered[1] else bare
    found = [each for token in _tokens(stem) for each in _parts(token)]
    marks = frozenset(found)
    of_unit = unit_of(unit)
    quantity = ""
    named = [each for each in found if each in QUANTITIES]
    if of_unit and (not named or of_unit[0] not in named):
        # A one-letter unit at the end of a name is one only where it fits.
        if named and unit and unit == in_name and len(unit) == 1:
            unit = ""
        elif not named or of_unit[0] == "acceleration":
            named = [of_unit[0]]
    if named:
        # In `torque_current` the torque is meant, and the current says where it comes from; in
        # `position speed` the last word is.
        quantity = "torque" if "torque" in named else named[-1]
    if quantity == "angle" and of_unit and of_unit[0] == "velocity":
        quantity = "velocity"
    side = next((each for each in ("motor", "load", "output") if each in marks), "")
    return Meaning(quantity, side, marks, stem.lower(), axis, unit)


def _tokens(name: str) -> list[str]:
    plain = name
    for letter, word in _LETTERS.items():
        plain = plain.replace(letter, word)
    split = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", plain)
    return [token.lower() for token in re.findall(r"[A-Za-z]+", split)]


@cache
def _parts(token: str) -> tuple[str, ...]:
    """Meanings of a token: of its own, or of the known words that it is put together from."""
    if token in _MEANING:
        return (_MEANING[token],)
    best: tuple[str, ...] = ()
    for cut in range(len(token) - 2, 2, -1):
        head = token[:cut]
        for link in _LINKS:
            if link and not head.endswith(link):
                continue
            word = head[: len(head) - len(link)]
            if len(word) >= 3 and word in _MEANING and (rest := _rest(token[cut:])):
                return (_MEANING[word], *rest)
    return best


def _rest(token: str) -> tuple[str, ...]:
    if token in ("sm", "cur") or len(token) >= 3:
        return _parts(token)
    return ()
