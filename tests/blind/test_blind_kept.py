"""The page's cases are kept: it is written from them, and the rules still say of them what they said."""

from pathlib import Path

import page
import pytest
from calibrate import judged_again
from judging import groups
from running import KEPT, lines_of

from hdsim.diagnosis.rules import RULES

PAGE = Path(__file__).parents[2] / "docs" / "blind.md"


@pytest.fixture(scope="module")
def lines():
    return lines_of([KEPT])


def test_the_page_is_what_its_cases_say(lines):
    assert PAGE.read_text(encoding="utf-8") == page.page(lines)


def test_the_rules_judge_every_stated_case_as_the_page_says(lines):
    stated = [line for line in lines if page.states(line) and line["verdict"]]
    assert stated
    for line in stated:
        again = judged_again(line, RULES)
        assert again["verdict"]["verdict"] in ("parameter", "nothing", line["verdict"]["verdict"])
        assert groups(again) == groups(line), line["key"]
