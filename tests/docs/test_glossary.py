"""The field's terms throughout: what is printed for users is free of home-made words, its labels are in the glossary."""

from __future__ import annotations

import ast
import html
import re
import sys
from pathlib import Path

import click
import numpy as np
import pytest
from matplotlib.figure import Figure

import hdsim
from hdsim.cli import COMMANDS, LazyGroup
from hdsim.tell import figures, fit_figures
from hdsim.tell.figures_where import located_figure
from hdsim.tell.findings import gather
from hdsim.tell.fit_report import save_fit

ROOT = Path(__file__).parents[2]
sys.path += [str(ROOT / "tests" / "tell"), str(ROOT / "tests" / "diagnose")]

from diagnose_bench import rigid_record, scenario  # noqa: E402
from telling import KINDS, page, told  # noqa: E402

#: Home-made words, and the field's term for each.
HOME_MADE = {
    r"own numbers": "parameters of the model",
    r"numbers? (of the model )?(is|are|that is|that are) off": "a parameter is wrong",
    r"what is left\b": "residual",
    r"(model|regression|names?|effects?|fit) leaves?\b": "residual",
    r"re-fitted numbers": "re-estimated parameters",
    r"without a name|has no name|have no name": "unidentified",
    r"named (effect|physics|law)": "identified effect",
    r"wrong name|a name needs|given a name": "identified effect",
    r"foretell|foretold": "predict",
    r"gap on (held-out|unseen|data)|held-out gap|unseen data": "residual on held-out data",
    r"lives? in|difference lives": "depends on, is a function of",
    r"put[- ]in effect|effect is put": "injected effect",
    r"plain regression": "linear regression",
    r"tied to": "confounded with",
    r"shakes up": "excites",
    r"the model lacks": "is missing from the model",
    r"farthest off": "largest deviation",
    r"corners? of (the|a) curve|each corner": "node",
}
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
#: Words of labels that need no explanation.
PLAIN = {
    "after", "after re-fit", "all records", "as given", "as measured", "before", "change", "content", "criterion",
    "effects", "file", "files", "final", "finding", "kind", "method", "met", "model", "model after",
    "model before", "next", "observed", "problems in the data", "re-fit", "reason", "relative", "severity",
    "the data", "time", "unit", "value", "what it means", "why this verdict", "forwards", "backwards", "combination",
    "against · for", "effects not tested", "direction of motion", "velocity", "temperature", "torque", "angle",
}  # fmt: skip


def found_in(text: str) -> list[str]:
    """Home-made words in a text, each with the field's."""
    return [
        f"{match.group(0)!r}: say {term!r}"
        for pattern, term in HOME_MADE.items()
        for match in re.finditer(rf"\b(?:{pattern})", " ".join(text.split()), re.IGNORECASE)
    ]


def prose(text: str) -> str:
    """A page without code and without fields in backquotes."""
    return re.sub(r"`[^`\n]*`", "", re.sub(r"```.*?```|^    .*$", "", text, flags=re.DOTALL | re.MULTILINE))


def terms() -> set[str]:
    """Terms of the glossary, in small letters."""
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    return {row.group(1).strip("` ").lower() for row in re.finditer(r"^\| ([^|]+?) \|", text, re.MULTILINE)}
