"""What users read has the field's terms and no home-made ones, and the glossary explains them."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import click
import pytest

from hdsim.cli import COMMANDS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
#: Home-made words, and the field's term for each.
HOME_MADE = {
    r"own numbers": "parameters",
    r"numbers? (of the model )?(is|are|that is|that are) off": "a parameter is wrong",
    r"re-?fitted numbers": "re-estimated parameters",
    r"what is left\b": "residual",
    r"(model|regression|the names?|effects?|fit|box) leaves?\b": "residual",
    r"without a name|(has|have) no name": "unidentified",
    r"named (effect|physics|law)": "identified effect",
    r"(wrong|right) name\b|a name needs|likely enough to be": "identified effect",
    r"foretell|foretold": "predict",
    r"gap on (held-out|unseen|data)|held-out gap|unseen data": "residual on held-out data",
    r"(difference|residual|trace) lives": "is a function of",
    r"put[- ]in effect|effect is put": "injected effect",
    r"plain regression": "linear regression",
    r"tied to": "confounded with",
    r"shakes up": "excites",
    r"the model lacks": "is missing from the model",
    r"farthest off|how far off the model": "deviation, residual",
    r"anybody's|somebody else's": "any",
}


def home_made(text: str) -> list[str]:
    """Home-made words in a text, each with the field's."""
    text = " ".join(text.split())
    return [
        f"{match.group(0)!r} ({term}) in ...{text[max(0, match.start() - 40) : match.end() + 20]}..."
        for pattern, term in HOME_MADE.items()
        for match in re.finditer(rf"\b(?:{pattern})", text, re.IGNORECASE)
    ]


def prose(text: str) -> str:
    """A page without its code."""
    text = re.sub(r"```.*?```|^    .*?$", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"`[^`\n]*`", "", text)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_pages_have_the_fields_terms(path: Path) -> None:
    assert home_made(prose(path.read_text(encoding="utf-8"))) == []


def test_home_made_words_are_found() -> None:
    assert len(home_made("Own numbers; they say what\nis left is a held-out gap.")) == 3
    assert home_made(prose("```\nown numbers\n```\nparameters `own numbers`\n\n    own numbers\n")) == []


@pytest.mark.parametrize("path", sorted((ROOT / "hdsim" / "tell").glob("*.py")), ids=lambda path: path.stem)
def test_texts_of_reports_have_the_fields_terms(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    texts = [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)]
    # Names of rules are those of the stored evidence, told by the texts beside them.
    keys = {
        k.value
        for n in ast.walk(tree)
        if isinstance(n, ast.Dict)
        for k in n.keys
        if isinstance(k, ast.Constant)
    }
    assert [found for text in texts if text not in keys for found in home_made(text)] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_the_fields_terms(name: str) -> None:
    target, line = COMMANDS[name]
    module, _, function = target.partition(":")
    command: click.Command = getattr(importlib.import_module(module), function)
    with click.Context(command, info_name=name) as context:
        assert home_made(f"{line} {command.get_help(context)}") == []


def test_the_glossary_is_alphabetical_and_each_term_has_a_sentence() -> None:
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    for section in text.split("\n## ")[1:]:
        rows = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")][1:]
        words = [row[0].strip("`").lower() for row in rows]
        assert len(set(words)) == len(words)
        if section.startswith("Terms"):
            assert words == sorted(words)
            assert [row[0] for row in rows if not row[-2].endswith(".")] == []
