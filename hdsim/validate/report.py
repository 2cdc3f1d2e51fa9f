"""The table on the terminal, as JSON and as Markdown."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import TYPE_CHECKING

from hdsim.validate.rows import Row, Verdict

if TYPE_CHECKING:
    from rich.console import Console

TITLE = "Validation"

_STYLE = {Verdict.HOLDS: "green", Verdict.FAILS: "bold red", Verdict.ABSENT: "dim"}


def number(value: float) -> str:
    """Four digits, or a dash for what there is not."""
    return "-" if math.isnan(value) else f"{value:,.0f}" if abs(value) >= 1e4 else f"{value:.4g}"


def deviation(row: Row) -> str:
    """In per cent, or in the unit where the tolerance is."""
    if math.isnan(row.deviation):
        return "-"
    return f"{100 * row.deviation:+.1f} %" if row.relative else f"{row.deviation:+.1g}"


def allowed(row: Row) -> str:
    """The tolerance as the deviation is written."""
    if row.limit:
        return "at most 0"
    return f"{100 * row.tolerance:.2g} %" if row.relative else f"{row.tolerance:.1g}"


def summary(rows: list[Row]) -> str:
    """How many rows of each verdict, and how many of them calibrate no parameter of the model."""
    count = Counter(row.verdict for row in rows)
    apart = Counter(row.verdict for row in rows if not row.fitted)
    absent = f", the data of {count[Verdict.ABSENT]} are absent" if count[Verdict.ABSENT] else ""
    return (
        f"{count[Verdict.HOLDS]} of {len(rows)} rows hold, {count[Verdict.FAILS]} fail{absent}; of those "
        f"that calibrate no parameter {apart[Verdict.HOLDS]} hold and {apart[Verdict.FAILS]} fail"
    )


def print_rows(rows: list[Row], console: Console | None = None) -> None:
    """Print the table, and below it the sources, the tolerances and the remarks."""
    from rich.table import Table

    from hdsim.console import console as standard

    shown = console or standard()
    table = Table(title=TITLE, title_justify="left", title_style="bold")
    table.add_column("row", style="dim")
    table.add_column("quantity")
    for heading in ("stated", "hdsim"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("unit")
    for heading in ("deviation", "allowed"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for row in rows:
        fitted = " *" if row.fitted else ""
        table.add_row(
            row.name, row.quantity + fitted, number(row.stated), number(row.computed), row.unit,
            deviation(row),
            allowed(row), f"[{_STYLE[row.verdict]}]{row.verdict}[/]",
        )  # fmt: skip
    shown.print(table)
    about: dict[str, list[str]] = {}
    for row in rows:
        remark = f" {row.remark[:1].upper()}{row.remark[1:]}." if row.remark else ""
        about.setdefault(f"{row.source}. Allowed: {row.because}.{remark}", []).append(row.name)
    for text, members in about.items():
        shown.print(f"{', '.join(members)}: {text}", markup=False, highlight=False)
    if any(row.fitted for row in rows):
        shown.print(
            "*: this value calibrated a parameter of the model, which only reproduces it", highlight=False
        )
    shown.print(f"{TITLE}: {summary(rows)}", markup=False, highlight=False, soft_wrap=True)


def to_json(rows: list[Row]) -> str:
    """Rows as JSON; NaN is null."""

    def plain(value: object) -> object:
        return None if isinstance(value, float) and math.isnan(value) else value

    listed = [
        {name: plain(value) for name, value in vars(row).items()}
        | {"deviation": plain(row.deviation), "verdict": str(row.verdict)}
        for row in rows
    ]
    return json.dumps(
        {"title": TITLE, "summary": summary(rows), "rows": listed}, indent=1, ensure_ascii=False
    )


def to_markdown(rows: list[Row]) -> str:
    """The table for a page, the rows that calibrate a parameter of the model marked with an asterisk."""
    lines = [
        "| quantity | source | stated | hdsim | unit | deviation | allowed | verdict |",
        "|" + "---|" * 8,
    ]
    for row in rows:
        mark = r"\*" if row.fitted else ""
        verdict = f"**{row.verdict}**" if row.verdict == Verdict.FAILS else str(row.verdict)
        cells = (
            row.quantity + mark, row.source, number(row.stated), number(row.computed), row.unit,
            deviation(row),
            f"{allowed(row)}: {row.because}", verdict,
        )  # fmt: skip
        lines.append(f"| {' | '.join(cell.replace('|', ' ') for cell in cells)} |")
    lines += ["", f"{summary(rows)}."]
    failing = [row for row in rows if row.remark and row.verdict == Verdict.FAILS]
    if failing:
        about: dict[str, list[str]] = {}
        for row in failing:
            about.setdefault(row.remark, []).append(row.name)
        lines += ["", "The failures:", ""]
        lines += [
            f"* {', '.join(f'`{name}`' for name in members)}: {text}." for text, members in about.items()
        ]
    return "\n".join(lines) + "\n"
