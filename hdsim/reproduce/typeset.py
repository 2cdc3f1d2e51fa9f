"""Formulas in plain text as HTML with Greek letters, superscripts and subscripts."""

from __future__ import annotations

import re
from html import escape

_GREEK = {
    name: f"&{name};"
    for name in ("alpha", "gamma", "Gamma", "delta", "nu", "phi", "pi", "psi", "sigma", "tau")
}
_WORDS = re.compile(rf"(?<![A-Za-z])(d?)({'|'.join(_GREEK)})(?![A-Za-z])")
_POWER_OF_TEN = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]?)0*(\d+)(?!\w)")
_SUBSCRIPT = re.compile(r"(?<=[A-Za-z;])_([A-Za-z0-9]+)")
_SIGNED = re.compile(r"(?<![\w)])-(?=[\d.])")


def typeset(text: str) -> str:
    """One line of text as HTML: ``psi^((3-D)/2)``, ``a_c``, ``6e7``, ``sqrt(x)``, ``um``, ``0..L``.

    Args:
        text: plain text; it is escaped.

    Example:
        >>> typeset("K_MB = 2 a_l^(3/2) at 1.5e-10 m")
        'K<sub>MB</sub> = 2 a<sub>l</sub><sup>3/2</sup> at 1.5&middot;10<sup>&minus;10</sup> m'
    """
    html = re.sub(r"\s*\.\.\s*", " to ", escape(text, quote=False))
    html = re.sub(r"(Eq\. \d+)-(?=\d)", r"\1&ndash;", html)
    html = re.sub(r"(?<=\d)-(?=\d*[A-Z]\b)|(?<=\b[A-Z])-(?=\d)", "&minus;", html)
    html = _POWER_OF_TEN.sub(_power_of_ten, html)
    html = _WORDS.sub(lambda m: m[1] + _GREEK[m[2]], html)
    html = re.sub(r"(?<![A-Za-z])Ds(?![A-Za-z])", "D_s", html)
    html = _SUBSCRIPT.sub(r"<sub>\1</sub>", html)
    html = _superscripts(html)
    html = re.sub(r"(?<![A-Za-z])sqrt(?=[ (])", "&radic;", html).replace("&radic; ", "&radic;")
    html = re.sub(r"(?<![A-Za-z])um(?![A-Za-z])", "&micro;m", html)
    html = html.replace("+-", "&plusmn;").replace(" * ", " &middot; ").replace("&gt;=", "&ge;")
    html = html.replace("N m/rad", "N&middot;m/rad")
    return _SIGNED.sub("&minus;", html)


def equation(text: str) -> str:
    """The same with single letters, the symbols, in italics."""
    html = re.sub(r"(?<=[\d)])-| - ", lambda m: m[0].replace("-", "&minus;"), typeset(text))
    # Letters inside tags and entities, the article "a", the units m and N stay upright.
    symbol = re.compile(r"(?<![A-Za-z&;<>/])((?<!\d )N|[A-MO-Zb-ln-z]|a(?=$|[)']| *[=^/(]))(?![A-Za-z;>])")
    parts = re.split(r"(<[^>]*>|&[a-zA-Z]+;)", html)
    return "".join(part if part.startswith(("<", "&")) else symbol.sub(r"<i>\1</i>", part) for part in parts)


def _power_of_ten(match: re.Match[str]) -> str:
    mantissa, sign, exponent = match.groups()
    power = f"10<sup>{'&minus;' if sign == '-' else ''}{exponent}</sup>"
    return power if mantissa == "1" else f"{mantissa}&middot;{power}"


def _superscripts(html: str) -> str:
    """``x^(...)`` with balanced brackets, and ``x^word``."""
    done = ""
    while (at := html.find("^")) >= 0:
        done, html = done + html[:at], html[at + 1 :]
        if html.startswith("("):
            depth, end = 1, 1
            while depth and end < len(html):
                depth += (html[end] == "(") - (html[end] == ")")
                end += 1
            inner, html = html[1 : end - 1], html[end:]
        else:
            word = re.match(r"-?[A-Za-z0-9.]*[A-Za-z0-9]", html)
            inner = word[0] if word else ""
            html = html[len(inner) :]
        done += f"<sup>{_superscripts(inner).replace('-', '&minus;')}</sup>"
    return done + html
