"""Units as people write them, and the ones that a mapping names."""

from __future__ import annotations

import re

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
