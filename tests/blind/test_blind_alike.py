"""Cases in which one effect was taken for two, neither of which seemed needed beside the other."""

from __future__ import annotations

import pytest
from judging import groups, outcome
from running import Task, attempt


@pytest.mark.slow
@pytest.mark.study
def test_two_formulas_of_one_effect_are_one_name() -> None:
    """A compliance by another law: play and compliance each explain 98 %, and neither seemed needed."""
    line = attempt(Task("numpy", 8, 13))
    assert outcome(line) == "right", line["verdict"]["sentence"]
    unbalance, compliance = groups(line)
    assert "unbalance" in unbalance
    assert {"output_backlash", "wave_generator_compliance"} <= set(compliance)
    assert line["closed"] > 0.85
