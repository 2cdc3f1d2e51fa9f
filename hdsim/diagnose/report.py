"""The report: one self-contained page that reads from the verdict downwards, and its figures as PNG."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdsim.diagnose import figures
from hdsim.diagnose.verdict import FittedNumber, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.diagnose.workflow import Diagnosis

_COLOUR = {"nothing": "#009E73", "parameter": "#0072B2", "effect": "#D55E00", "unknown": "#8A3FA0"}
_HEADLINE = {
    "nothing": "Nothing is missing",
    "parameter": "Numbers of the model are off",
    "effect": "The model is missing an effect",
    "unknown": "Something unknown is missing",
}
_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#222;max-width:1080px;margin:2em auto;padding:0 1.2em}
h1{font-size:1.5em;margin:.2em 0}h2{font-size:1.15em;margin:1.8em 0 .4em}
.verdict{border-left:8px solid;padding:.6em 1.2em;background:#f6f6f6}.verdict p{margin:.3em 0;font-size:1.1em}
table{border-collapse:collapse;margin:.4em 0}
td,th{padding:.25em .8em;border-bottom:1px solid #ddd;text-align:left}
td.n{text-align:right;font-variant-numeric:tabular-nums}img{max-width:100%}
.note{color:#555;font-size:.93em}.warn{background:#fff4e5;padding:.5em 1em;border-left:4px solid #D55E00}
"""


def write_report(diagnosis: Diagnosis, out: Path) -> Path:
    """Write ``report.html`` and its figures into a directory; returns the report's path."""
    verdict = diagnosis.verdict
    pictures = {
        "gap": figures.gap_figure(verdict),
        "located": figures.located_figure(diagnosis),
        "traces": figures.trace_figure(diagnosis),
    }
    embedded = {}
    for name, figure in pictures.items():
        if figure is None:
            continue
        figure.savefig(out / f"{name}.png")
        embedded[name] = _embedded(figure)
    path = out / "report.html"
    path.write_text(_page(verdict, embedded), encoding="utf-8")
    return path


def _embedded(figure: Figure) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}">'


def _page(verdict: Verdict, pictures: dict[str, str]) -> str:
    colour = _COLOUR[verdict.verdict]
    parts = [
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{_HEADLINE[verdict.verdict]}</title>",
        f"<style>{_STYLE}</style><body>",
        f"<div class='verdict' style='border-color:{colour}'><h1>{_HEADLINE[verdict.verdict]}</h1>",
        f"<p>{html.escape(verdict.sentence)}</p><p class='note'>{html.escape(_sureness(verdict))}</p></div>",
        "<h2>How far the model is off, on data that no fit has seen</h2>",
        _gap_table(verdict),
        pictures.get("gap", ""),
    ]
    for effect in verdict.effects:
        if effect.indistinguishable_from:
            lines = "".join(
                f"<li><b>{html.escape(other)}</b>: "
                f"{html.escape(effect.separated_by.get(other) or 'no rule known')}</li>"
                for other in effect.indistinguishable_from
            )
            parts.append(
                f"<div class='warn'>These data cannot tell <b>{html.escape(effect.title)}</b> from the "
                f"following; what separates them:<ul>{lines}</ul></div>"
            )
    if verdict.suspects:
        listed = ", ".join(f"{name} ({100 * share:.0f} %)" for name, share in verdict.suspects.items())
        parts.append(
            "<div class='warn'>Effects that explain a part, not enough to be named: "
            f"{html.escape(listed)}.</div>"
        )
    parts += ["<h2>Where the difference lives</h2>", pictures.get("located", ""), _located_table(verdict)]
    parts += ["<h2>Measured, and the model before and after</h2>", pictures.get("traces", "")]
    for effect in verdict.effects:
        parts.append(f"<h2>Fitted: {html.escape(effect.title)}</h2>{_numbers(effect.parameters)}")
    parts += ["<h2>The model's own numbers</h2>", _numbers(verdict.parameters)]
    parts += ["<h2>The data</h2>", _problems(verdict)]
    if verdict.not_tried:
        items = "".join(
            f"<li>{html.escape(name)}: {html.escape(why)}</li>" for name, why in verdict.not_tried.items()
        )
        parts.append(f"<h2>Effects that could not be tried</h2><ul class='note'>{items}</ul>")
    if verdict.scenario:
        parts.append(f"<p class='note'>The model with what was found: {html.escape(verdict.scenario)}</p>")
    return "\n".join([*parts, "</body></html>"])


def _sureness(verdict: Verdict) -> str:
    if not verdict.effects:
        return ""
    return " ".join(
        f"{effect.title}: the chance that the search over the whole catalogue finds such a trace where there "
        f"is none is below {100 * effect.chance:.2g} %; it was the best, alone or with those it cannot be "
        f"told from, in {100 * effect.confidence:.0f} % of resampled records."
        for effect in verdict.effects
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = "".join(f"<th>{html.escape(h)}</th>" for h in head)
    lines = "".join(
        "<tr>" + "".join(f"<td{_number_class(c)}>{html.escape(c)}</td>" for c in row) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{cells}</tr>{lines}</table>"


def _number_class(cell: str) -> str:
    return " class='n'" if cell[:1].isdigit() or cell[:1] == "-" else ""


def gap_rows(verdict: Verdict) -> list[list[str]]:
    """Rows of the gap table; the columns are ``GAP_HEAD``."""
    rows = []
    for channel, gap in verdict.gap.items():
        share = 100 * gap.after / gap.variation if gap.variation else np.nan
        multiple = f"{gap.after / gap.noise:.2g}" if gap.noise else "-"
        numbers = [f"{v:.3g}" for v in (gap.before, gap.refit, gap.after, gap.noise)]
        rows.append([channel, gap.unit, *numbers, f"{share:.2g} %", multiple])
    return rows


GAP_HEAD = ("channel", "unit", "before", "re-fit", "after", "noise", "after / variation", "after / noise")


def _gap_table(verdict: Verdict) -> str:
    return _table(GAP_HEAD, gap_rows(verdict))


def _located_table(verdict: Verdict) -> str:
    rows = [
        [
            p.stage,
            p.channel,
            p.coordinate.replace("_", " "),
            f"{100 * p.share:.1f} %",
            ", ".join(f"{order:.3g}" for order in p.orders),
        ]
        for p in verdict.located
    ]
    head = (
        "stage",
        "channel",
        "function of",
        "share of what is left (cross-validated)",
        "orders per motor turn",
    )
    return _table(head, rows)


def _numbers(numbers: dict[str, FittedNumber]) -> str:
    rows = []
    for name, n in numbers.items():
        interval = (
            "not determined by these data"
            if n.interval is None
            else f"{n.interval[0]:.4g} to {n.interval[1]:.4g}"
        )
        if n.interval is None and n.start is None:
            interval = "read from the spectrum"
        if n.tied_to:
            interval += f" (tied to {', '.join(n.tied_to)})"
        rows.append([name, "" if n.start is None else f"{n.start:.4g}", f"{n.value:.4g}", interval])
    return _table(("number", "before", "fitted", "95 % interval"), rows)


def _problems(verdict: Verdict) -> str:
    if not verdict.data_problems:
        return "<p>No problem found.</p>"
    rows = [[p.severity, p.record, p.channel, p.kind, p.message] for p in verdict.data_problems]
    return _table(("", "record", "channel", "kind", "what was found"), rows)
