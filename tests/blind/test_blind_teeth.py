"""What is judged of cases against a base with teeth: gaps, which tooth, the section of the page."""

import math

import pytest
from page import page
from page_teeth import half_gap, held, measures, teeth, teeth_away

GAP, TOOTH = [["flank_wear", "output_backlash"]], [["tooth_error"]]


def line(kind, truth, *names, strength=5.0, number=0, seed=1, setup=None, said=None):
    effects = [
        {"name": name, "indistinguishable_from": [], "confidence": 0.9, "parameters": {}} for name in names
    ]
    return {
        "key": f"teeth/{kind}/x/{number}/{seed}", "family": "teeth", "number": number, "seed": seed,
        "kind": kind, "truth": truth, "strength": [strength] if truth else [], "error": None, "cpu_s": 3.0,
        "setup": {"sensors": "both", "ratio": -100.0, "half_gap_um": 1.5} | (setup or {}), "numbers": [],
        "verdict": {"verdict": "effect" if names else "nothing", "effects": effects, "suspects": {},
                    "teeth": said},
        "closed": 0.95,
    }  # fmt: skip


def gap(value, interval, *, number=0):
    said = {"member": "", "tooth": None, "half_gap_um": {"value": value, "interval": interval}}
    return line("effect", GAP, "flank_wear", number=number, said=said)


def tooth(member, number, said_member, said_number, ratio=-100.0):
    said = {"member": said_member, "tooth": {"value": said_number}, "half_gap_um": None}
    setup = {"ratio": ratio, "changes": {"tooth_error": {"member": member, "tooth": number}}}
    return line("effect", TOOTH, "tooth_error", setup=setup, said=said)


@pytest.mark.parametrize(
    ("ratio", "member", "out", "said", "away"),
    [
        (-100.0, "flexspline", 57.0, 58.5, 1.5),
        (-100.0, "flexspline", 157.0, 57.25, 0.25),  # the opposite one of 200
        (-100.0, "flexspline", 199.0, 1.0, 2.0),
        (-100.0, "circular_spline", 150.0, 50.0, 1.0),  # 202 teeth: the opposite one is 101 on
        (100.0, "flexspline", 198.0, 0.0, 0.0),  # the flexspline of the other arrangement has 198
        (-100.0, "flexspline", 10.0, 60.0, 50.0),
    ],
)
def test_a_tooth_and_its_opposite_are_one(ratio, member, out, said, away):
    assert teeth_away(tooth(member, out, member, said, ratio)) == pytest.approx(away)


def test_the_other_spline_is_wrong_and_no_tooth_is_none():
    assert teeth_away(tooth("flexspline", 10.0, "circular_spline", 10.0)) == math.inf
    assert teeth_away(line("effect", TOOTH)) is None
    assert teeth_away(gap(1.5, [1.0, 2.0])) is None


def test_a_tooth_of_the_other_spline_that_is_told_as_well_counts():
    one = tooth("flexspline", 10.0, "circular_spline", 11.0)
    one["verdict"]["teeth"] |= {"or_member": "flexspline", "or_tooth": {"value": 10.5}}
    assert teeth_away(one) == pytest.approx(0.5)
    assert (
        "10 of the flexspline | 11.0 of the circular spline or 10.5 of the flexspline | 0.5 |"
        in "\n".join(teeth([one], []))
    )
    one["verdict"]["teeth"] |= {"or_member": "", "or_tooth": None}
    assert teeth_away(one) == math.inf


def test_a_half_gap_is_asked_where_the_gap_is_hidden_and_told():
    assert half_gap(gap(1.4, [1.2, 1.6])) == (1.5, 1.4, 1.2, 1.6)
    assert held(gap(1.4, [1.2, 1.6]))
    assert not held(gap(1.2, [1.1, 1.4]))
    assert half_gap(gap(1.2, None)) is None
    assert half_gap(line("effect", GAP, "flank_wear")) is None
    told = {"member": "", "tooth": None, "half_gap_um": {"value": 1.0, "interval": [0.5, 2.0]}}
    assert half_gap(line("null", [], "flank_wear", said=told)) is None


def test_the_section_counts_what_is_asked():
    lines = [
        gap(1.4, [1.2, 1.6]), gap(1.2, [1.1, 1.4], number=1), line("effect", GAP),
        tooth("flexspline", 57.0, "flexspline", 58.0), tooth("flexspline", 57.0, "flexspline", 60.0),
        line("effect", TOOTH, "sensors"), line("null", []), line("null", [], "sensors"),
    ]  # fmt: skip
    found = measures(lines)
    assert found["first effect right, strength 3.5 to 10"] == (4, 6)
    assert found["first effect right, a gap hidden"] == (2, 3)
    assert found["first effect right, a tooth hidden"] == (2, 3)
    assert found["false alarm where nothing is hidden"] == (1, 2)
    assert found["true mean half-gap in its 95 % interval, where one is told"] == (1, 2)
    assert found["tooth within two, where one is named"] == (1, 2)
    text = "\n".join(teeth(lines, []))
    assert "| teeth/effect/x/1/1 | 3.5 to 10 | 1.5 | 1.2 | 1.1 to 1.4 | **no** |" in text
    assert "2 of 2 estimates lie below the truth" in text
    assert "57 of the flexspline | 60.0 of the flexspline | 3.0 |" in text
    assert text in page(lines)


def test_without_such_cases_there_is_no_section():
    other = line("null", []) | {"family": "numpy"}
    even = line("null", [], seed=2)
    assert teeth([other], [even]) == []
