"""Tutorials do what they say: every file is saved, every command run, every line that is shown is printed."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "docs" / "_ext"))

from steps import BLOCK, follow, missing, steps  # noqa: E402

TUTORIALS = [ROOT / "docs" / "start.md", *sorted((ROOT / "docs" / "tutorials").glob("*.md"))]


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_does_what_it_says(page: Path, tmp_path: Path) -> None:
    for step in steps(page):
        printed = follow(step, tmp_path)
        assert list(missing(step.shown, printed)) == [], printed


def test_no_block_of_a_tutorial_is_left_out() -> None:
    for page in TUTORIALS:
        found = steps(page)
        files = {name for step in found for name in step.files}
        blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
        assert {language for language, _ in blocks} <= {"bash", "text", "yaml", "python"}
        assert len(files) == sum(language in ("yaml", "python") for language, _ in blocks)
        assert all(step.commands for step in found)


def test_what_is_shown_is_held_against_what_is_printed() -> None:
    printed = "┃ cause ┃ share ┃\n│ hysteresis │ +2.018 │ 63% │\n│ whole      │ 3.1 │"
    assert list(missing(["│ hysteresis │  +2.02 │", "│ whole │ 3.1 │"], printed)) == []
    for wrong in ("│ hysteresis │ +2.2 │", "│ hysteresis │ -2.018 │", "│ heat │ 2 │", "whole"):
        assert list(missing([wrong], printed)) == [wrong]
    assert list(missing(["│ whole │", "│ hysteresis │"], printed)) == ["│ hysteresis │"]
