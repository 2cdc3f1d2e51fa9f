"""The blind page's section on drives that are held against a base with teeth: gaps, and which tooth."""

from __future__ import annotations

import math
from collections.abc import Sequence

from judging import Line, false_alarm, outcome
from page_tables import BANDS, band, requirements, table

FAMILY = "teeth"
#: How far from the tooth that is out of place the named one may be, teeth.
WITHIN = 2.0
ASKED = {
    "first effect right, strength 3.5 to 10": ">= 90 % (at 5)",
    "false alarm where nothing is hidden": "<= 5 %",
    "true mean half-gap in its 95 % interval, where one is told": "90 to 98 %",
    "tooth within two, where one is named": ">= 90 %",
}


def half_gap(line: Line) -> tuple[float, float, float, float] | None:
    """True mean half-gap of a case in which the gap is hidden, estimate and ends of its interval, um.

    ``None`` where another thing is hidden, or the verdict tells no half-gap.
    """
    told = ((line["verdict"] or {}).get("teeth") or {}).get("half_gap_um")
    if told is None or told["interval"] is None or not _hidden(line, "flank_wear"):
        return None
    return (line["setup"]["half_gap_um"], told["value"], *told["interval"])


def held(line: Line) -> bool:
    """Whether the interval of ``half_gap`` holds the truth."""
    truth, _, low, high = half_gap(line) or (math.nan,) * 4
    return low <= truth <= high


def teeth_away(line: Line) -> float | None:
    """Teeth from the named one to the one that is out of place or its opposite, whichever is nearer.

    Where the verdict says that a tooth of the other spline explains the data as well, that one counts too.
    Infinite on the wrong spline. ``None`` where no tooth is out of place, or none is named.
    """
    said = (line["verdict"] or {}).get("teeth") or {}
    if not _hidden(line, "tooth_error") or not said.get("tooth"):
        return None
    true, ratio = line["setup"]["changes"]["tooth_error"], line["setup"]["ratio"]
    named = {said["member"]: said["tooth"]}
    if said.get("or_tooth"):
        named[said["or_member"]] = said["or_tooth"]
    if true["member"] not in named:
        return math.inf
    count = round(2 * abs(ratio)) - (2 if ratio > 0 else 0) + 2 * (true["member"] == "circular_spline")
    away = (named[true["member"]]["value"] - true["tooth"]) % (0.5 * count)
    return float(min(away, 0.5 * count - away))


def _hidden(line: Line, name: str) -> bool:
    return line["kind"] == "effect" and name in line["truth"][0]


def measures(lines: Sequence[Line]) -> dict[str, tuple[int, int]]:
    """Numbers of right ones and of cases, by what is asked."""
    effects = [r for r in lines if r["kind"] == "effect"]
    found = {}
    for low, high in BANDS:
        own = [r for r in effects if band(r) == f"{low:g} to {high:g}"]
        found[f"first effect right, strength {low:g} to {high:g}"] = (_right(own), len(own))
    for title, name in (("gap", "flank_wear"), ("tooth", "tooth_error")):
        own = [r for r in effects if _hidden(r, name)]
        found[f"first effect right, a {title} hidden"] = (_right(own), len(own))
    quiet = [r for r in lines if r["kind"] == "null"]
    found["false alarm where nothing is hidden"] = (sum(map(false_alarm, quiet)), len(quiet))
    gaps = [r for r in effects if half_gap(r) is not None]
    found["true mean half-gap in its 95 % interval, where one is told"] = (sum(map(held, gaps)), len(gaps))
    away = [a for r in effects if (a := teeth_away(r)) is not None]
    found["tooth within two, where one is named"] = (sum(a <= WITHIN for a in away), len(away))
    found["stopped with an error"] = (sum(outcome(r) == "error" for r in lines), len(lines))
    return found


def _right(lines: Sequence[Line]) -> int:
    return sum(outcome(r) == "right" for r in lines)


def teeth(stated: Sequence[Line], others: Sequence[Line]) -> list[str]:
    """The section; none where no case of the family may be stated."""
    stated, others = ([r for r in lines if r["family"] == FAMILY] for lines in (stated, others))
    if not stated:
        return []
    text = ["## Against a base with teeth (`teeth`)", ""]
    text += [*requirements(measures, ASKED, "", stated, others), ""]
    text += [*_gaps(stated), ""]
    return [*text, "Teeth that were named, `inf` on the wrong spline:", "", *_teeth(stated), ""]


def _gaps(lines: Sequence[Line]) -> list[str]:
    rows, below = [], 0
    for r in lines:
        own = half_gap(r)
        if own is not None:
            below += own[1] < own[0]
            truth, value, low, high = (f"{number:.3g}" for number in own)
            ends, holds = f"{low} to {high}", "yes" if held(r) else "**no**"
            name = f"`{r['verdict']['effects'][0]['name']}`"
            rows.append([r["key"], band(r), truth, value, ends, holds, name])
    return [
        f"Half-gaps that were told, um. {below} of {len(rows)} estimates lie below the truth: the gaps",
        "of the plants have all grown in proportion, and where the name is `output_backlash`, the estimate",
        "is of gaps that are all wider by the same, whose mean is less for the same wind-up (the teeth with",
        "the least gap touch first). The interval spans both ways.",
        "",
        *table(["key", "strength", "truth", "estimate", "95 % interval", "holds", "named"], rows),
    ]


def _teeth(lines: Sequence[Line]) -> list[str]:
    rows = []
    for r in lines:
        away = teeth_away(r)
        if away is None:
            continue
        true, said = r["setup"]["changes"]["tooth_error"], r["verdict"]["teeth"]
        named = _tooth_of(said["tooth"]["value"], said["member"], 1)
        if said.get("or_tooth"):
            named += f" or {_tooth_of(said['or_tooth']['value'], said['or_member'], 1)}"
        out = _tooth_of(true["tooth"], true["member"], 0)
        rows.append([r["key"], band(r), out, named, f"{away:.1f}"])
    return table(["key", "strength", "out of place", "named", "teeth off"], rows)


def _tooth_of(number: float, member: str, digits: int) -> str:
    return f"{number:.{digits}f} of the {member.replace('_', ' ')}"
