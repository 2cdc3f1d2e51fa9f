"""Tables and sections of a page, and the rows that a terminal shows too."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from typing import Any

from hdsim.diagnosis.verdict import Verdict
from hdsim.estimate.found import ParameterEstimate
from hdsim.tell.words import named_number, short, shown, spoken, unit_of

GAP_HEAD = ("channel", "unit", "before", "re-fit", "after", "noise", "after/before", "after/noise")
#: An interval wider than this many times its estimate is called poorly determined.
WIDE = 1.0


def gap_rows(verdict: Verdict) -> list[list[str]]:
    """Rows of the table of held-out residuals in readable units; the columns are ``GAP_HEAD``."""
    rows = []
    for channel, gap in verdict.gap.items():
        unit = unit_of(gap)
        numbers = [short(unit.factor * v) for v in (gap.before, gap.refit, gap.after, gap.noise)]
        known = math.isfinite(gap.after)
        share = f"{100 * gap.after / gap.before:.0f} %" if known and gap.before > 0 else "-"
        multiple = f"{gap.after / gap.noise:.2f}" if known and gap.noise > 0 else "-"
        rows.append([spoken(channel), unit.name, *numbers, share, multiple])
    return rows


def with_curve_words(verdict: Verdict) -> str:
    """Held-out residuals with the curve of the remaining residual; empty where it is not confirmed."""
    said = []
    for channel, gap in verdict.gap.items():
        if gap.with_curve is not None:
            unit = unit_of(gap)
            curved, after = (short(unit.factor * value) for value in (gap.with_curve, gap.after))
            said.append(f"{curved} instead of {after} {unit.name} ({spoken(channel)})")
    return ", ".join(said)


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table as HTML.

    Args:
        head: names of the columns.
        rows: cells; they are escaped.
        numbers: columns that are set to the right.
    """
    kinds = [" class='n'" if k in numbers else "" for k in range(len(head))]
    cells = "".join(f"<th{kind}>{html.escape(h)}</th>" for kind, h in zip(kinds, head, strict=True))
    lines = "".join(
        "<tr>" + "".join(f"<td{k}>{html.escape(c)}</td>" for k, c in zip(kinds, row, strict=True)) + "</tr>"
        for row in rows
    )
    return f"<div class='wide'><table><tr>{cells}</tr>{lines}</table></div>"


def section(title: str, body: str, kind: str = "") -> str:
    """A section of a page as HTML.

    Args:
        title: its heading; it is escaped.
        body: HTML.
        kind: class of its style, if any.
    """
    return f"<section{f' class={kind}' if kind else ''}><h2>{html.escape(title)}</h2>{body}</section>"


def numbers_table(
    numbers: Mapping[str, ParameterEstimate],
    moved: Sequence[str] = (),
    settings: Mapping[str, Any] | None = None,
) -> str:
    """Parameter estimates with their intervals and changes; those in ``moved`` are marked.

    Args:
        numbers: by path.
        moved: paths of those whose interval excludes the model's value.
        settings: of the effect whose parameters they are; its orders name harmonics.
    """
    based = any(n.start is not None for n in numbers.values())
    head = [
        "parameter",
        "unit",
        *(["model", "estimate", "change"] if based else ["estimate"]),
        "95 % interval",
    ]
    lines = []
    # Those that moved come first, those that are not identifiable last.
    order = sorted(numbers, key=lambda name: (name not in moved, numbers[name].interval is None))
    for name in order:
        n = numbers[name]
        if settings is not None and name.endswith(".order"):
            continue  # it names the harmonic in the other rows
        words, unit = named_number(name, settings)
        cells = [
            f"<td>{html.escape(words)}<code>{html.escape(name)}</code></td>",
            f"<td class='u'>{unit}</td>",
        ]
        if based:
            start = "" if n.start is None else shown(n.start)
            moved_by = 100 * (n.value / n.start - 1) if n.start else 0.0
            change = f"{moved_by:+.1f} %" if abs(moved_by) >= 0.05 and n.interval is not None else ""
            cells += [f"<td class='n'>{text}</td>" for text in (start, shown(n.value), change)]
        else:
            cells.append(f"<td class='n'>{shown(n.value)}</td>")
        cells.append(f"<td>{html.escape(_interval(n, unit))}</td>")
        mark = " class='moved'" if name in moved else ""
        lines.append(f"<tr{mark}>{''.join(cells)}</tr>")
    right = {"model", "estimate", "change"}
    titles = "".join(f"<th{' class=n' if h in right else ''}>{h}</th>" for h in head)
    return f"<div class='wide'><table><tr>{titles}</tr>{''.join(lines)}</table></div>"


def _interval(number: ParameterEstimate, unit: str) -> str:
    if number.interval is None:
        if number.start is None:
            return "fixed, or read from the spectrum"
        tied = "; ".join(named_number(name)[0] for name in number.tied_to)
        return "not identifiable from these data" + (f": confounded with {tied}" if tied else "")
    low, high = number.interval
    text = f"{shown(low)} to {shown(high)}"
    if number.tied_to:
        text += (
            f", from the prior; confounded with {'; '.join(named_number(name)[0] for name in number.tied_to)}"
        )
    # The size of a phase means nothing; 120 degrees leave two thirds of the circle.
    if high - low > (120.0 if unit == "deg" else WIDE * abs(number.value)):
        text += " (poorly determined)"
    return text
