"""Rows on the terminal, as JSON and Markdown, and written to files."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.errors import InputError
from hdsim.reproduce.page import (
    CITATION,
    DOI,
    OPENING,
    TITLE,
    TONE,
    headlines,
    sections,
    to_html,
    told_choices,
)
from hdsim.reproduce.rows import Row, Verdict

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {
    Verdict.REPRODUCED: "green",
    Verdict.CHOICE: "cyan",
    Verdict.CONTRADICTED: "red",
    Verdict.OPEN: "yellow",
}

#: Longer lines are hard to read.
_WIDEST = 120


def summary(rows: list[Row]) -> str:
    """How many rows of each verdict."""
    count = Counter(row.verdict for row in rows)
    return ", ".join(f"{count[verdict]} {verdict}" for verdict in Verdict)


def print_rows(rows: list[Row], console: Console | None = None) -> None:
    """Print the rows to the terminal, a block each, so that they are readable at any width."""
    import textwrap

    from rich.text import Text

    from hdsim.console import console as standard

    shown = console or standard()
    width = min(shown.width, _WIDEST)
    for row in rows:
        title = Text.assemble(
            (f"{row.source}  ", "bold"),
            (row.verdict, f"bold {_STYLE[row.verdict]}"),
            (f"  {row.name}", "dim"),
        )
        shown.print(title, soft_wrap=True)
        for name, text in (
            ("", row.statement), ("paper", row.paper), ("hdsim", row.computed), ("why", row.reason),
            ("corrected", row.correction),
            *(("chosen", f"{what}; {other}") for what, other in row.choices.items()),
        ):  # fmt: skip
            if text:
                first = f"  {name:<11}" if name else "  "
                lines = textwrap.wrap(
                    text, width, initial_indent=first, subsequent_indent=" " * len(first),
                    break_long_words=False, break_on_hyphens=False,
                )  # fmt: skip
                block = Text("\n".join(lines))
                block.stylize("dim" if name else "", 0, len(first))
                shown.print(block, soft_wrap=True)
        shown.print()
    shown.print(f"{TITLE}: {summary(rows)}", markup=False, highlight=False, soft_wrap=True)


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

    lines = [f"# {TITLE}", "", f"{CITATION}, [doi:{DOI}](https://doi.org/{DOI})", "", OPENING, ""]
    lines += [f"{summary(rows)}.", "", *(f"* {cell(sentence)}" for sentence in headlines(rows)), "", TONE]
    lines += ["", cell(told_choices(rows))] if told_choices(rows) else []
    for title, about, members in sections(rows):
        lines += ["", f"## {title}", "", *([about, ""] if about else [])]
        lines += ["| source | statement | paper | hdsim | verdict | reason | corrected | chosen |"]
        lines.append("|" + "---|" * 8)
        for r in members:
            cells = [r.source, r.statement, r.paper, r.computed, f"**{r.verdict}**", r.reason, r.correction]
            cells.append("; ".join(f"{what}; {other}" for what, other in r.choices.items()))
            lines.append("| " + " | ".join(c if i == 4 else cell(c) for i, c in enumerate(cells)) + " |")
    for file, caption in figures.items():
        lines += ["", f"![{caption}]({file})", "", f"*{caption}*"]
    return "\n".join(lines) + "\n"


def write(rows: list[Row], folder: Path, form: str) -> list[Path]:
    """Write ``json``, ``markdown`` or ``html`` (with figures) into a folder; returns the files.

    Raises:
        InputError: when the folder cannot be written, or the form is unknown.
    """
    from hdsim.reproduce.figures import FIGURES, draw

    if form not in ("json", "markdown", "html"):
        raise InputError(f"form must be json, markdown or html, found {form!r}")
    figures = {} if form == "json" else draw({row.name for row in rows})
    files: dict[str, bytes] = {}
    if form == "json":
        files["reproduction.json"] = to_json(rows).encode()
    elif form == "html":
        places = {name: patterns for name, (_, patterns, _) in FIGURES.items()}
        files["reproduction.html"] = to_html(rows, figures, places).encode()
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
