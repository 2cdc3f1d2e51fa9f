"""The reproduction as one HTML page: a referee's report."""

from __future__ import annotations

from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatch
from html import escape

from hdsim.reproduce import paper
from hdsim.reproduce.rows import Row, Verdict
from hdsim.reproduce.typeset import equation, typeset

TITLE = "Zhang et al. (2021), recomputed"
SUBTITLE = "A referee's report on the equations, tables, figures and printed numbers"
CITATION = (
    "Zhang, Liu, Yang, Wang and Liu (2021), Study on gear contact stiffness and backlash of harmonic drive "
    "based "
    "on fractal theory"
)
DOI = "10.21203/rs.3.rs-652069/v1"

OPENING = (
    "The paper leads from two measured tooth flanks of a harmonic drive, through a Weierstrass-Mandelbrot "
    "description of their roughness, to the stiffness and the backlash of a tooth pair. Every step of that "
    "way "
    "was computed again from the equations as printed, each by a second, independent route: quadrature "
    "over the "
    "asperities, numerical roots and derivatives, synthetic surfaces with known D and G, elastic boundary "
    "elements."
)
TONE = (
    "The idea is sound and worth building on: hdsim does. What follows is about the print, not about the "
    "authors, "
    "who may well have computed with something that the text does not show. Where a statement does not "
    "follow "
    "from the equations, the equation that does stands beside it; where the paper leaves a choice open, "
    "the choice "
    "made here is named, so that it can be contradicted in turn."
)
#: Rows of printed numbers that follow only once something is chosen: the choices to mistrust first.
_NUMBERS = ("table-4-*", "stiffness-summed")

#: The main findings, for the summary: a row, the verdict that they need, and a sentence over its values.
_HEADLINES: tuple[tuple[str, Verdict, str], ...] = (
    (
        "stiffness-averaged",
        Verdict.CONTRADICTED,
        "With the averaged D' and G' the equations give {at_low_hardness_n_per_m:.1e} N/m or more at rated "
        "load, "
        "over ten times the printed 6e7.",
    ),
    (
        "stiffness-summed",
        Verdict.OPEN,
        "Adding the two flanks' structure functions instead, which is not the paper's method, meets the "
        "printed number at a hardness of {hardness_of_6e7_pa:.3g} Pa, chosen for it; with G corrected for "
        "Eq. 18 it is {mended_at_low_hardness_n_per_m:.1e} N/m or more.",
    ),
    (
        "fig-10a",
        Verdict.CONTRADICTED,
        "At a fixed force the equations make the stiffness rise with D and fall with G; Fig. 10 and the "
        "text say "
        "the opposite ({steps_with_claimed_sign:.0f} of {steps:.0f} steps over D have the paper's sign).",
    ),
    (
        "eq-10",
        Verdict.CONTRADICTED,
        "The second branch of Eq. 10 overestimates the load, {overestimate:.1f} times in the example below.",
    ),
    (
        "eq-18",
        Verdict.CONTRADICTED,
        "The constant of Eq. 18 is not that of the profile of Eq. 1: G is overestimated {G_ratio_pair:.1f} "
        "times "
        "at D = 2.535. D is not affected. hdsim's default drive has the measured heights with the G that "
        "Eq. 1 needs for them; the preset seed-2021-printed-roughness has G as printed.",
    ),
    (
        "eq-21",
        Verdict.CONTRADICTED,
        "Eq. 21 needs the radius, not the diameter; the printed force of 34.67 N is right.",
    ),
    (
        "drive-backlash",
        Verdict.OPEN,
        "For the whole drive, the measured pair's play is {play_mended_arcsec:.0f} arcsec "
        "({play_summed_arcsec:.0f} with G as printed) beside a "
        "hysteresis loss of {hysteresis_loss_arcsec:.0f} and a kinematic error of "
        "{kinematic_error_arcsec:.0f}.",
    ),
    (
        "drive-stiffness",
        Verdict.OPEN,
        "Its contacts turn the output by {contact_mended_arcsec:.0f} arcsec at rated torque "
        "({contact_summed_arcsec:.0f} with G as printed), the whole drive by "
        "{whole_arcsec:.0f}: backlash is the part of the paper that a user of the drive will notice.",
    ),
)

_STYLE = """
body{font:16px/1.5 Georgia,'Times New Roman',serif;color:#222;max-width:60rem;margin:2.5em auto;
padding:0 1.2em}
h1{font-size:1.9em;margin:0 0 .1em}h2{margin:2.2em 0 .6em;border-bottom:1px solid #bbb;padding-bottom:.2em}
h3{font-size:1.05em;margin:0 0 .4em}.subtitle{font-size:1.15em;color:#555;margin:0 0 .8em}
.count b{padding:.1em .5em;border-radius:.3em;margin-right:.6em;white-space:nowrap}
article{border-left:4px solid;padding:.5em 1em;margin:1.1em 0;background:#fafafa;break-inside:avoid}
dl{display:grid;grid-template-columns:6.5em 1fr;gap:.2em .8em;margin:0}dt{color:#666}dd{margin:0}
.equation{font-size:1.08em}.name{float:right;color:#999;font:.75em monospace}
table{border-collapse:collapse;font-size:.88em}td,th{border-top:1px solid #ccc;padding:.4em .7em .4em 0;
vertical-align:top;text-align:left}figure{margin:1.6em 0}img{max-width:100%}
figcaption{font-size:.88em;color:#555;margin-top:.3em}sub,sup{line-height:0;font-size:.75em}
@media(max-width:40rem){dl{grid-template-columns:1fr}dt{margin-top:.4em}}
"""
_COLOUR = {
    Verdict.REPRODUCED: ("#2e7d32", "#e3f4e3"),
    Verdict.CHOICE: ("#5b7a1f", "#eef3da"),
    Verdict.CONTRADICTED: ("#b3261e", "#fbe3e1"),
    Verdict.OPEN: ("#b07d00", "#fbf1d5"),
}
#: Caption and PNG by name, and the patterns of the rows that a figure belongs to.
Figures = Mapping[str, tuple[str, bytes]]
Places = Mapping[str, Sequence[str]]


def headlines(rows: Iterable[Row]) -> list[str]:
    """The main findings among these rows, as sentences with their numbers."""
    known = {row.name: row for row in rows}
    return [
        sentence.format(**known[name].values)
        for name, verdict, sentence in _HEADLINES
        if name in known and known[name].verdict == verdict
    ]


def chosen(rows: Iterable[Row]) -> list[str]:
    """What was fixed for these rows that the paper does not state, each once."""
    return list(dict.fromkeys(what for row in rows for what in row.choices))


def told_choices(rows: Sequence[Row]) -> str:
    """How many choices were made, which, and which of them for the printed numbers; empty for none."""
    every = chosen(rows)
    if not every:
        return ""
    numbers = chosen(row for row in rows if any(fnmatch(row.name, pattern) for pattern in _NUMBERS))
    others = [what for what in every if what not in numbers]
    text = f"Choices that were made: {len(every)}; each stands at its rows, with what other values give."
    if numbers:
        text += f" For the printed numbers of Table 4 and for 6e7: {len(numbers)} ({'; '.join(numbers)})."
    return text + (f" For other rows: {len(others)} ({'; '.join(others)})." if others else "")


def sections(rows: Sequence[Row]) -> list[tuple[str, str, list[Row]]]:
    """Headings, one line of introduction and rows, findings first; empty sections are left out."""
    own = [row for row in rows if row.name.startswith("drive-")]
    rest = [row for row in rows if row not in own]
    found = [
        (
            "What does not follow",
            "Statements that the paper's own equations or physics contradict, with the correction.",
            [row for row in rest if row.verdict == Verdict.CONTRADICTED],
        ),
        (
            "What the paper leaves open",
            "A sentence or a number from the authors would settle each of these.",
            [row for row in rest if row.verdict == Verdict.OPEN],
        ),
        (
            "What it means for the drive",
            "The paper ends at the tooth. This is what its backlash and stiffness do to a whole drive with "
            "the "
            "catalogue's torsional stiffness, hysteresis and kinematic error.",
            own,
        ),
        (
            "What is reproduced with a stated choice",
            "Each follows once something is fixed that the paper does not state.",
            [row for row in rest if row.verdict == Verdict.CHOICE],
        ),
        ("What is reproduced", "", [row for row in rest if row.verdict == Verdict.REPRODUCED]),
    ]
    return [part for part in found if part[2]]


def to_html(rows: Sequence[Row], figures: Figures, places: Places) -> str:
    """One self-contained page.

    Args:
        rows: the rows.
        figures: caption and PNG by name.
        places: patterns of the rows that each figure belongs to; it follows the section with most of them.
    """
    from importlib.metadata import version

    count = Counter(row.verdict for row in rows)
    counted = "".join(
        f'<b style="background:{_COLOUR[v][1]}">{count[v]} {v}</b>' for v in Verdict if count[v]
    )
    points = "".join(f"<li>{typeset(sentence)}</li>" for sentence in headlines(rows))
    parts = sections(rows)
    home: dict[str, list[tuple[int, str]]] = {}
    for name in figures:
        matches = [
            [row.name for row in part[2] if any(fnmatch(row.name, p) for p in places[name])] for part in parts
        ]
        best = max(range(len(parts)), key=lambda k: (len(matches[k]), -k), default=0)
        if parts:
            home.setdefault(matches[best][-1] if matches[best] else "", []).append((best, name))
    body = ""
    for title, about, members in parts:
        body += f"<h2>{title}</h2>{f'<p>{about}</p>' if about else ''}"
        compact = members[0].verdict == Verdict.REPRODUCED and not members[0].name.startswith("drive-")
        if compact:
            body += _table(members)
        for row in members:
            body += "" if compact else _article(row)
            body += "".join(_figure(*figures[name]) for _, name in home.get(row.name, []))
    constants = (
        f"E = {paper.MATERIALS.reduced_modulus_pa:.4g} Pa (reduced modulus), H = {paper.HARDNESS_PA:.3g} "
        "Pa unless "
        "stated otherwise, and what the rows themselves name. The page was made by"
    )
    told = f"<p>{typeset(told_choices(rows))}</p>" if told_choices(rows) else ""
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>{TITLE}</title><style>{_STYLE}</style></head><body>"
        f'<h1>{TITLE}</h1><p class="subtitle">{SUBTITLE}</p>'
        f'<p>{escape(CITATION)}, <a href="https://doi.org/{DOI}">doi:{DOI}</a></p>'
        f'<h2>Summary</h2><p>{escape(OPENING)}</p><p class="count">{counted}</p>'
        f"{f'<ul>{points}</ul>' if points else ''}<p>{escape(TONE)}</p>{told}{body}"
        f"<h2>How to repeat it</h2><p>Every number on this page was computed when the page was made; none is "
        "stored but what the paper prints. Chosen here, because the paper gives no value: "
        f"{typeset(constants)} "
        f"<code>hdsim reproduce</code>, hdsim {version('hdsim')}; <code>--only NAME</code> repeats one row, "
        "<code>--format json</code> gives the numbers in SI units.</p></body></html>\n"
    )


def _article(row: Row) -> str:
    lines = [("paper", typeset(row.paper)), ("hdsim", typeset(row.computed)), ("why", typeset(row.reason))]
    lines += [("chosen", typeset(f"{what}; {other}")) for what, other in row.choices.items()]
    if row.correction:
        name = "corrected" if row.verdict == Verdict.CONTRADICTED else "reads"
        lines.append((name, f'<span class="equation">{equation(row.correction)}</span>'))
    entries = "".join(f"<dt>{name}</dt><dd>{html}</dd>" for name, html in lines)
    colour, name = _COLOUR[row.verdict][0], escape(row.name)
    return (
        f'<article id="{name}" style="border-color:{colour}"><span class="name">{name}'
        f"</span><h3>{escape(row.source)}: {typeset(row.statement)}</h3><dl>{entries}</dl></article>\n"
    )


def _table(rows: Sequence[Row]) -> str:
    body = ""
    for row in rows:
        note = f"{row.reason}. {row.correction}" if row.correction else row.reason
        note += "".join(f". {what}; {other}" for what, other in row.choices.items())
        cells = [row.source, row.statement, row.paper, row.computed, note]
        entries = "".join(f"<td>{typeset(c)}</td>" for c in cells)
        body += f'<tr id="{escape(row.name)}">{entries}</tr>\n'
    head = "".join(f"<th>{name}</th>" for name in ("source", "statement", "paper", "hdsim", "note"))
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>\n"


def _figure(caption: str, png: bytes) -> str:
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{b64encode(png).decode()}">'
        f"<figcaption>{typeset(caption)}</figcaption></figure>\n"
    )
