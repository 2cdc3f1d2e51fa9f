"""Units as people write them, and the ones that a mapping names."""

from __future__ import annotations

import math
import re

TURN = 2 * math.pi
#: Factor to SI and offset of each unit that a mapping may name, by kind of quantity.
ANGLE_UNITS = {
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": TURN / 360,
    "arcmin": TURN / 21600,
    "arcsec": TURN / 1296000,
    "rev": TURN,
}
VELOCITY_UNITS = {"rad/s": 1.0, "deg/s": TURN / 360, "rpm": TURN / 60, "rev/s": TURN}
_POUND_FORCE_N, _INCH_M = 4.4482216152605, 0.0254
TORQUE_UNITS = {"N m": 1.0, "mN m": 1e-3, "N cm": 1e-2, "kN m": 1e3}
TORQUE_UNITS |= {"lbf in": _POUND_FORCE_N * _INCH_M, "lbf ft": _POUND_FORCE_N * 12 * _INCH_M}
CURRENT_UNITS = {"A": 1.0, "mA": 1e-3}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

#: What is written for each unit of a mapping, in lower case without spaces, dots and signs of multiplication.
_WRITTEN: dict[tuple[str, str], str] = {
    ("time", "s"): "s sec secs second seconds sek sekunde sekunden",
    ("time", "ms"): "ms msec millis millisecond milliseconds millisekunden",
    ("time", "us"): "us µs μs usec micros microsecond microseconds mikrosekunden",
    ("time", "ns"): "ns nsec nanosecond nanoseconds",
    ("angle", "rad"): "rad radian radians",
    ("angle", "mrad"): "mrad",
    ("angle", "deg"): "deg degs degree degrees ° grad",
    ("angle", "arcmin"): "arcmin ' ′ winkelminuten",
    ("angle", "arcsec"): "arcsec \" ″ '' winkelsekunden",
    ("angle", "rev"): "rev revs revolution revolutions turn turns umdr umdrehung umdrehungen u",
    (
        "angle",
        "count",
    ): "count counts cnt cnts inc incs increments ink inkremente tick ticks pulse pulses lsb digits",
    ("velocity", "rad/s"): "rad/s rad/sec rads^-1 rads-1 rads⁻¹ radps radpers",
    ("velocity", "deg/s"): "deg/s deg/sec °/s grad/s dps degps degs^-1 degs-1 degpers",
    ("velocity", "rpm"): "rpm 1/min u/min min^-1 min-1 min⁻¹ r/min rev/min tr/min giri/min revpermin rpmin",
    ("velocity", "rev/s"): "rev/s rps u/s r/s turn/s turns/s",
    ("torque", "N m"): "nm newtonmeter newtonmetre n-m",
    ("torque", "mN m"): "mnm mn-m",
    ("torque", "N cm"): "ncm n-cm",
    ("torque", "kN m"): "knm kn-m",
    ("torque", "lbf in"): "lbfin inlbf lbf-in in-lbf inlb inlbs in-lb in-lbs lbin lb-in",
    ("torque", "lbf ft"): "lbfft ftlbf lbf-ft ft-lbf ftlb ftlbs ft-lb ft-lbs lbft lb-ft",
    ("current", "A"): "a amp amps ampere arms a_rms aeff apk",
    ("current", "mA"): "ma milliampere marms",
    ("temperature", "degC"): "degc °c c ℃ celsius grdc",
    ("temperature", "K"): "k kelvin",
    ("temperature", "degF"): "degf °f f ℉ fahrenheit",
    ("acceleration", "rad/s^2"): "rad/s^2 rad/s2 rad/s² rads^-2 rads-2 rads⁻²",
    ("acceleration", "deg/s^2"): "deg/s^2 deg/s2 deg/s² °/s² °/s^2 °/s2",
}
_KNOWN = {word: unit for unit, words in _WRITTEN.items() for word in words.split()}
_ISO = frozenset({"iso", "iso8601", "datetime", "utc", "yyyy-mm-ddthh:mm:ss"})
_BRACKETED = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|\s(?:in|/)\s+(\S+))\s*")
#: Tails of names that are units beyond doubt; one letter, or ``min``, may be something else.
_TAILS = sorted(
    (
        word
        for word, (_, unit) in _KNOWN.items()
        if re.fullmatch(r"[a-z]{2,}", word) and unit not in ("count", "rev", "K", "degF") and word != "arms"
    ),
    key=len,
    reverse=True,
)
_WITH_BAR = {"rad_s": "rad/s", "rad_per_s": "rad/s", "deg_s": "deg/s", "deg_per_s": "deg/s", "n_m": "Nm"}


def unit_of(text: str) -> tuple[str, str] | None:
    """Kind of quantity (``angle``, ``velocity``, ``current``, ...) and unit that a text states.

    >>> unit_of("[U/min]")
    ('velocity', 'rpm')
    """
    plain = re.sub(r"^[\[({<]|[\])}>]$", "", text.strip()).strip()
    if plain.lower() in _ISO:
        return "time", "iso"
    plain = re.sub(r"[\s*·.⋅]", "", plain)
    if plain in ("S", "NS", "MS", "M", "G"):  # siemens, and what no recording of a drive has
        return None
    if plain.startswith("MN"):
        return None
    return _KNOWN.get(plain.lower())


def split_name(name: str) -> tuple[str, str]:
    """A column's name and the unit that is written in it, or ""; such as ``Drehzahl [U/min]``, ``q_deg``."""
    if (found := _BRACKETED.fullmatch(name)) and found[1]:
        text = next(group for group in found.groups()[1:] if group is not None)
        if unit_of(text):
            return found[1], text
    lower = name.lower()
    for tail, unit in _WITH_BAR.items():
        if lower.endswith("_" + tail):
            return name[: -len(tail) - 1], unit
    head, bar, tail = lower.rpartition("_")
    if bar and head and (tail in _TAILS or tail in ("s", "a", "c")):
        return name[: len(head)], name[len(head) + 1 :]
    # camelCase: speedRpm, angleDeg, torqueNm, currentA.
    camel = re.fullmatch(r"(.*[a-z0-9])((?:[mu]?[A-Z])[A-Za-z]*)", name)
    if camel and (camel[2].lower() in _TAILS or camel[2] == "A"):
        return camel[1], camel[2]
    return name, ""
