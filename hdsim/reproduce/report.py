"""Rows as a terminal table, JSON, Markdown and HTML."""

from __future__ import annotations

import json
from base64 import b64encode
from collections import Counter
from html import escape
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hdsim.errors import InputError
from hdsim.reproduce.rows import Row, Verdict

TITLE = "Zhang et al. (2021), recomputed"
INTRODUCTION = (
    "Every equation, table, figure and printed number of Zhang, Liu, Yang, Wang and Liu (2021), Study on "
    "gear contact "
    "stiffness and backlash of harmonic drive based on fractal theory (doi:10.21203/rs.3.rs-652069/v1), "
    "computed again "
    "from the equations. The model holds together: the asperity integrals, the backlash table and the "
    "near-linear "
    "stiffness are reproduced. Where a printed equation or claim does not follow, the corrected one "
    "stands beside it."
)
_STYLE = {Verdict.REPRODUCED: "green", Verdict.CONTRADICTED: "red", Verdict.OPEN: "yellow"}


def summary(rows: list[Row]) -> str:
    """How many rows of each verdict."""
    count = Counter(row.verdict for row in rows)
    return ", ".join(f"{count[verdict]} {verdict}" for verdict in Verdict)


def print_table(rows: list[Row], console: Console | None = None) -> None:
    """Print the rows to the terminal."""
    table = Table(title=TITLE, show_lines=True)
    for name in ("source", "statement", "paper", "hdsim", "verdict", "reason"):
        table.add_column(name, overflow="fold")
    for row in rows:
        reason = row.reason + (f"\nCorrected: {row.correction}" if row.correction else "")
        cells = [
            row.source,
            row.statement,
            row.paper,
            row.computed,
            f"[{_STYLE[row.verdict]}]{row.verdict}[/]",
            reason,
        ]
        table.add_row(*(c if i == 4 else c.replace("[", r"\[") for i, c in enumerate(cells)))
    console = console or Console()
    console.print(table)
    console.print(summary(rows))


def to_json(rows: list[Row]) -> str:
    """Rows as JSON, the numbers behind the words included."""
    from hdsim.reproduce.paper import HARDNESS_PA, MATERIALS

    constants = {"hardness_pa": HARDNESS_PA, "reduced_modulus_pa": MATERIALS.reduced_modulus_pa}
    return json.dumps({"title": TITLE, "constants": constants, "rows": [vars(row) for row in rows]}, indent=1)


def to_markdown(rows: list[Row], figures: dict[str, str]) -> str:
    """A page with its figures as links.

    Args:
        rows: the rows.
        figures: caption by file name.
    """

    def cell(text: str) -> str:
        return text.replace("|", r"\|").replace("<", "&lt;").replace("*", r"\*").replace("\n", " ")

    lines = [f"# {TITLE}", "", INTRODUCTION, "", f"{summary(rows)}.", ""]
    lines += ["| source | statement | paper | hdsim | verdict | reason | corrected |", "|" + "---|" * 7]
    for r in rows:
        cells = (r.source, r.statement, r.paper, r.computed, f"**{r.verdict}**", r.reason, r.correction)
        lines.append("| " + " | ".join(c if i == 4 else cell(c) for i, c in enumerate(cells)) + " |")
    for file, caption in figures.items():
        lines += ["", f"![{caption}]({file})", "", f"*{caption}*"]
    return "\n".join(lines) + "\n"


def to_html(rows: list[Row], figures: dict[str, tuple[str, bytes]]) -> str:
    """One self-contained page.

    Args:
        rows: the rows.
        figures: caption and PNG by name.
    """
    colour = {Verdict.REPRODUCED: "#e3f4e3", Verdict.CONTRADICTED: "#fbe3e3", Verdict.OPEN: "#fbf4d9"}
    head = "".join(
        f"<th>{h}</th>" for h in ("source", "statement", "paper", "hdsim", "verdict", "reason, correction")
    )
    body = ""
    for r in rows:
        reason = escape(r.reason) + (
            f"<p><b>Corrected:</b> {escape(r.correction)}</p>" if r.correction else ""
        )
        cells = [escape(text) for text in (r.source, r.statement, r.paper, r.computed)]
        cells += [f"<b>{escape(r.verdict)}</b>", reason]
        row = "".join(f"<td>{c}</td>" for c in cells)
        body += f'<tr id="{escape(r.name)}" style="background:{colour[r.verdict]}">{row}</tr>\n'
    pictures = "".join(
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{b64encode(png).decode()}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>\n"
        for caption, png in figures.values()
    )
    style = (
        "body{font:15px/1.45 sans-serif;max-width:1200px;margin:2em auto;padding:0 1em}"
        "table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.4em .6em;vertical-align:top;"
        "text-align:left}img{max-width:100%}figure{margin:1.5em 0}p{margin:.4em 0}"
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f"<title>{TITLE}</title><style>{style}</style></head>"
        f"<body><h1>{TITLE}</h1><p>{escape(INTRODUCTION)}</p><p><b>{escape(summary(rows))}</b></p>"
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{pictures}</body></html>\n"
    )


def write(rows: list[Row], folder: Path, form: str) -> list[Path]:
    """Write ``json``, ``markdown`` or ``html`` (with figures) into a folder; returns the files.

    Raises:
        InputError: when the folder cannot be written, or the form is unknown.
    """
    from hdsim.reproduce.figures import draw

    if form not in ("json", "markdown", "html"):
        raise InputError(f"form must be json, markdown or html, found {form!r}")
    figures = {} if form == "json" else draw({row.name for row in rows})
    files: dict[str, bytes] = {}
    if form == "json":
        files["reproduction.json"] = to_json(rows).encode()
    elif form == "html":
        files["reproduction.html"] = to_html(rows, figures).encode()
    else:
        files |= {f"{name}.png": png for name, (_, png) in figures.items()}
        captions = {f"{name}.png": caption for name, (caption, _) in figures.items()}
        files["reproduction.md"] = to_markdown(rows, captions).encode()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    return [folder / name for name in files]
