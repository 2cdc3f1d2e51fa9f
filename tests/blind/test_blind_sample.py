"""A few drawn cases from end to end; ``make blind`` runs hundreds and writes docs/blind.md."""

import json

import pytest
from judging import OUTCOMES, outcome
from running import attempt, stored, task_of

#: Short logs of every kind.
SAMPLE = (
    pytest.param("numpy/parameter/-/3/0", marks=pytest.mark.study),
    "numpy/effect/-/31/98",
    pytest.param("numpy/effect/-/34/50", marks=pytest.mark.study),
    pytest.param("numpy/null/-/7/0", marks=pytest.mark.study),
)


@pytest.mark.slow
@pytest.mark.parametrize("key", SAMPLE)
def test_blind(key):
    line = json.loads(stored(attempt(task_of(key))))
    assert line["error"] is None
    assert line["key"].split("/")[1] == line["kind"] == key.split("/")[1]
    assert outcome(line) in OUTCOMES
    assert line["verdict"]["gap"]
    assert line["cpu_s"] > 0
    # Both are processor seconds, of all threads.
    assert sum(line["seconds"].values()) <= line["cpu_s"] + 1.0
    assert {"sensors", "rate_hz", "held", "formula", "records", "seconds"} <= set(line["setup"])
    assert all(len(row) == 6 and row[3] <= row[4] for row in line["numbers"])
    # What ideal sensors read stays with the judge.
    assert "ideal" not in line["verdict"]


@pytest.mark.slow
@pytest.mark.study
def test_a_play_that_is_taken_up_by_another_law_leaves_the_base_as_it_was_given():
    """The plain formula bends the first stiffness to 0.6 of what it is, and closes 75 % of the gap."""
    line = attempt(task_of("numpy/effect/output_backlash/2/20"))
    (play,) = line["verdict"]["effects"]
    assert play["name"] == "output_backlash"
    stiffness = line["verdict"]["parameters"]["drive.torsion.stiffness_k1_nm_per_rad"]
    assert stiffness["value"] == pytest.approx(stiffness["start"], rel=0.1)
    assert line["closed"] > 0.9


@pytest.mark.slow
@pytest.mark.study
def test_a_tooth_is_named_though_a_re_fit_bends_the_base_until_no_trace_of_it_is_left():
    """The motor alone tells of it; the re-fit makes the load's inertia a fifth, the motor's three times."""
    line = attempt(task_of("numpy/effect/damaged_tooth/0/22"))
    assert outcome(line) == "right"
    assert line["closed"] > 0.8
