"""Judging, storing and the page, on lines that are written by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest
from contract import Case, Measured
from drawing import together
from judging import borne_out, closed, covered, false_alarm, false_name, outcome, stated
from page import page
from page_tables import band, rate
from reliability import binned, calibration_error, picture
from running import Task, lines_of, stored


def line(kind, truth, verdict, *names, strength=5.0, number=0, **more):
    effects = [
        {"name": group[0], "indistinguishable_from": list(group[1:]), "confidence": 0.9, "parameters": {}}
        for group in names
    ]
    hidden = [] if kind in ("null", "parameter") else [strength]
    return {
        "key": f"numpy/{kind}/x/{number}/1", "family": "numpy", "number": number, "seed": 1, "kind": kind,
        "truth": truth, "strength": hidden, "error": None, "cpu_s": 3.0, "setup": {"sensors": "both"},
        "verdict": {"verdict": verdict, "effects": effects, "suspects": {}}, "numbers": [], "closed": 0.95,
    } | more  # fmt: skip


ONE = [["stribeck_friction"]]
TWO = [["stribeck_friction"], ["kinematic_error"]]


@pytest.mark.parametrize(
    ("case", "wanted"),
    [
        (line("effect", ONE, "effect", ["lugre_friction", "stribeck_friction"], ["unbalance"]), "right"),
        (line("effect", ONE, "effect", ["unbalance"], ["stribeck_friction"]), "wrong name"),
        (line("effect", ONE, "effect", ["a", "b", "c", "stribeck_friction"]), "wrong name"),
        (line("effect", ONE, "unknown"), "unknown"),
        (line("effect", ONE, "parameter"), "nothing"),
        (line("pair", TWO, "effect", ["kinematic_error"], ["stribeck_friction"]), "right"),
        (line("pair", TWO, "effect", ["kinematic_error"]), "wrong name"),
        (line("outside", [], "unknown"), "right"),
        (line("outside", [], "effect", ["unbalance"]), "wrong name"),
        (line("null", [], "nothing"), "right"),
        (line("null", [], "parameter"), "right"),
        (line("null", [], "unknown"), "unknown"),
        (line("parameter", [], "nothing"), "nothing"),
        (line("parameter", [], "parameter"), "right"),
        (line("null", [], "") | {"verdict": None, "error": "ValueError: x"}, "error"),
    ],
)
def test_outcomes(case, wanted):
    assert outcome(case) == wanted


def real(verdict, *names, before=(), order=2.0, size=10.0, truth="kinematic_error"):
    """A line of a real machine: names by their component's order and size."""

    def component(o, a):
        return (
            {"components.0.order": {"value": o}, "components.0.amplitude_arcmin": {"value": a}} if o else {}
        )

    def said(verdict, names):
        effects = [
            {"name": name, "indistinguishable_from": [], "confidence": 0.9, "parameters": component(o, a)}
            for name, o, a in names
        ]
        return {"verdict": verdict, "suspects": {}, "effects": effects}

    at = {"order": order, "field": "amplitude_arcmin", "size": size}
    return line("effect" if truth else "null", [[truth]] if truth else [], "") | {
        "setup": {"at": at, "own": ["sensors"]},
        "verdict": said(verdict, names),
        "without": {"verdict": said("effect", before)},
    }


OWN = ("stribeck_friction", 0.0, 0.0)


@pytest.mark.parametrize(
    ("case", "wanted"),
    [
        (real("effect", OWN, ("kinematic_error", 2.0, 9.0), before=[OWN]), "right"),
        # The joint has that order of its own, far smaller.
        (real("effect", ("kinematic_error", 2.0, 9.0), before=[("kinematic_error", 2.0, 1.0)]), "right"),
        (real("effect", ("kinematic_error", 2.0, 9.0), before=[("kinematic_error", 2.0, 9.0)]), "nothing"),
        (real("effect", ("kinematic_error", 4.0, 9.0), before=[OWN]), "nothing"),
        (real("effect", ("damaged_tooth", 0.0, 0.0), before=[OWN]), "wrong name"),
        (real("effect", OWN, before=[OWN]), "nothing"),
        (real("unknown", before=[OWN]), "unknown"),
        # Known of the joint, and not named without what was put in.
        (real("effect", ("sensors", 0.0, 0.0), truth=""), "right"),
        (real("effect", OWN, before=[OWN], truth=""), "right"),
        (real("effect", ("unbalance", 0.0, 0.0), before=[OWN], truth=""), "wrong name"),
    ],
)
def test_outcomes_beside_the_recording_without_it(case, wanted):
    assert outcome(case) == wanted
    assert false_name(case) == (wanted == "wrong name" and bool(case["truth"]))


def test_false_names_and_alarms():
    assert false_name(line("effect", ONE, "effect", ["unbalance"]))
    assert not false_name(line("effect", ONE, "effect", ["a", "b", "c", "stribeck_friction"]))
    assert not false_name(line("effect", ONE, "unknown"))
    assert false_alarm(line("null", [], "unknown"))
    assert false_alarm(line("null", [], "") | {"verdict": None})
    assert not false_alarm(line("parameter", [], "nothing"))


def test_confidence_counts_the_first_name_and_a_verdicts_own_where_there_is_one():
    half = line("pair", TWO, "effect", ["kinematic_error"])
    assert stated(half) == 0.9
    assert borne_out(half)
    silent = line("null", [], "nothing")
    assert stated(silent) is None
    silent["verdict"]["confidence"] = 0.7
    assert stated(silent) == 0.7
    assert borne_out(silent)


RIPPLE = ("sensors", 0.0, 0.0)


@pytest.mark.parametrize(
    ("names", "before", "wanted"),
    [
        # What was put in speaks, wherever it stands, and a new name that is wrong.
        ((RIPPLE, ("kinematic_error", 2.0, 9.0)), (RIPPLE,), (0.7, True)),
        ((RIPPLE, ("unbalance", 0.0, 0.0)), (RIPPLE,), (0.7, False)),
        # Its source says that the joint's sensor ripples: that is right, whatever was missed beside it.
        ((OWN, RIPPLE), (OWN, RIPPLE), (0.7, True)),
        # Of what the recording gets anyway nobody knows whether it is right.
        ((OWN,), (OWN,), (None, False)),
    ],
)
def test_confidence_in_a_recording_is_that_of_what_was_put_in_or_is_known(names, before, wanted):
    one = real("effect", *names, before=before)
    one["verdict"]["effects"][-1]["confidence"] = 0.7 if len(names) > 1 else 0.9
    assert (stated(one), borne_out(one)) == wanted


def test_calibration_error_is_the_distance_of_shares_from_what_was_stated():
    lines = [line("effect", ONE, "effect", ["stribeck_friction" if k < 6 else "x"]) for k in range(10)]
    assert calibration_error(lines) == (pytest.approx(0.3), 10)
    lines += [line("effect", ONE, "effect", ["stribeck_friction"]) for _ in range(10)]
    for one in lines[10:]:
        one["verdict"]["effects"][0]["confidence"] = 1.0
    assert calibration_error(lines) == (pytest.approx(0.15), 20)
    assert [n for *_, n in binned(lines)] == [10, 10]


def test_what_can_be_closed_and_numbers_that_hold():
    rng = np.random.default_rng(1)
    ideal = np.zeros(4000)
    measured = Measured(
        "a", np.arange(4000.0), {"motor_torque": rng.normal(0, 2.0, 4000)}, {"motor_torque": ideal}
    )
    true = {"components.0.order": 2.0, "components.0.phase_deg": 359.0, "load.inertia_kg_m2": 3.0}
    hidden = (frozenset({"kinematic_error"}),)
    case = Case("numpy/effect/x/0/1", "numpy", "effect", hidden, (measured,), (), "", numbers=true)
    gap = {"motor_torque": {"before": 22.0, "refit": 12.0, "after": 3.0, "noise": 9.0}}
    assert closed(case, gap) == pytest.approx(0.9, abs=0.01)
    assert closed(case, gap, since="before") == pytest.approx(0.95, abs=0.01)
    assert closed(case, {"motor_torque": {"refit": 2.1, "after": 3.0, "noise": 9.0}}) is None
    # What the plant itself leaves along the log's motion is nobody's to close: nine of nine.
    rattling = replace(case, records=(replace(measured, followed={"motor_torque": 3.0}),))
    assert closed(rattling, gap) == 1.0
    # What the machine itself leaves is nobody's either.
    own = {"motor_torque": {"after": 2.9, "noise": 1.0}}
    assert closed(case, gap, without=own) == pytest.approx((12.0 - 3.0) / (12.0 - 2.9), abs=1e-3)

    def number(value, low, high):
        return {"value": value, "interval": [low, high]}

    parameters = {
        "components.1.order": number(2.001, 1.9, 2.1),
        "components.1.phase_deg": number(2.0, -4.0, 8.0),
    }
    verdict = {"parameters": {"load.inertia_kg_m2": number(3.5, 3.2, 3.8)},
               "effects": [{"name": "kinematic_error", "parameters": parameters}]}  # fmt: skip
    rows = {row[0]: row[5] for row in covered(case, verdict)}
    assert rows == {"components.0.order": True, "components.0.phase_deg": True, "load.inertia_kg_m2": False}
    verdict["effects"][0]["name"] = "unbalance"
    assert [row[0] for row in covered(case, verdict)] == ["load.inertia_kg_m2"]


def test_stored_lines_come_back_the_last_of_a_case_counts_and_a_cut_one_does_not(tmp_path):
    path = tmp_path / "lines.jsonl"
    first, second = line("null", [], "unknown"), line("null", [], "nothing")
    second["setup"] = {"rate_hz": np.float64(3.0), "off": frozenset({"b", "a"})}
    other = line("null", [], "nothing", number=4)
    text = "\n".join(stored(r) for r in (first, other, second))
    path.write_text(text + "\n" + stored(first)[:40], encoding="utf-8")
    found = {Task(r["family"], r["number"], r["seed"]): r for r in lines_of([path, tmp_path / "none.jsonl"])}
    assert len(found) == 2
    assert outcome(found[Task("numpy", 0, 1)]) == "right"
    assert found[Task("numpy", 0, 1)]["setup"] == {"rate_hz": 3.0, "off": ["a", "b"]}


def test_the_page_states_odd_seeds_and_the_family_left_out_alone(tmp_path):
    lines = [line("effect", ONE, "effect", ["stribeck_friction"], number=k, strength=5.0) for k in range(8)]
    lines += [line("effect", ONE, "effect", ["unbalance"], number=9, strength=60.0)]
    lines += [line("effect", ONE, "unknown", number=k, seed=2) for k in range(3)]
    lines += [line("effect", ONE, "unknown", number=k, seed=2, family="mujoco") for k in range(1)]
    text = page(json.loads(json.dumps(lines)))
    rows = {
        row.split(" | ")[0].strip("| "): row.split(" | ") for row in text.splitlines() if row.startswith("|")
    }
    five = rows["first effect right, strength 3.5 to 10"]
    assert five[1] == "9"
    assert five[2].startswith("89 %")
    assert five[4] == "3"
    assert rows["wrong first effect where one is hidden"][2].startswith("10 %")
    assert "2 of 10. To repeat one" in text
    picture(lines, tmp_path / "images" / "reliability.png")
    assert (tmp_path / "images" / "reliability.png").stat().st_size > 5000


def test_bands_and_rates():
    assert band(line("effect", ONE, "unknown", strength=1.49)) == "0.5 to 1.5"
    assert band(line("effect", ONE, "unknown", strength=1.5)) == "1.5 to 3.5"
    assert band(line("effect", ONE, "unknown", strength=120.0)) == "35 to 100"
    # 10 of 10: the lower end is 0.025^(1/10) (Clopper and Pearson 1934).
    assert rate(10, 10) == f"100 % ({100 * 0.025**0.1:.0f} to 100)"


def test_the_size_of_a_motors_ripple_is_what_its_current_reads():
    ripple = {"order": 6.0, "cogging_nm": 0.12}
    effect = {"name": "motor_torque_ripple", "indistinguishable_from": [], "confidence": 0.9}
    effect |= {"parameters": {}, "settings": {"components": [ripple]}}
    said = {"verdict": "effect", "suspects": {}, "effects": [effect]}
    at = {"order": 6.0, "field": "cogging_nm", "size": 0.05}
    one = line("effect", [["motor_torque_ripple"]], "") | {"setup": {"at": at, "own": []}, "verdict": said}
    one["without"] = {"verdict": {"verdict": "nothing", "suspects": {}, "effects": []}}
    assert outcome(one) == "nothing"
    said["parameters"] = {"motor_torque_gain": {"value": 0.5}}
    assert outcome(one) == "right"
    # A component of the output's turn is another order.
    ripple["per"] = "output_turn"
    assert outcome(one) == "nothing"


@pytest.mark.parametrize(
    ("order", "before", "wanted"), [(4.0, 2.0, "right"), (2.0, 2.0, "nothing"), (4.0, 4.0, "nothing")]
)
def test_a_name_that_stands_in_for_another_does_so_at_its_own_order_only(order, before, wanted):
    # The bare joint's sensor ripples, and its data cannot tell that from a kinematic error of the same order.
    ripple = {"output_angle": {"ripple": [{"order": before, "amplitude_arcsec": 30.0, "phase_deg": 10.0}]}}
    own = {"name": "sensors", "indistinguishable_from": ["kinematic_error"], "confidence": 0.9}
    one = real("effect", ("kinematic_error", order, 9.0), order=order)
    one["without"]["verdict"]["effects"] = [own | {"parameters": {}, "settings": ripple}]
    assert outcome(one) == wanted


@pytest.mark.parametrize(("order", "wanted"), [(4.0, "right"), (2.0, "nothing")])
def test_a_stand_in_with_what_was_put_in_needs_its_order(order, wanted):
    ripple = {"output_angle": {"ripple": [{"order": order, "amplitude_arcsec": 30.0, "phase_deg": 10.0}]}}
    named = {"name": "sensors", "indistinguishable_from": ["kinematic_error"], "confidence": 0.9}
    one = real("effect", OWN, order=4.0, before=[OWN])
    one["verdict"]["effects"] = [named | {"parameters": {}, "settings": ripple}]
    assert outcome(one) == wanted


def test_a_field_that_two_hidden_effects_have_is_asked_of_neither():
    bristles, flexspline = {"coulomb_nm": 0.03, "stiffness_nm": 17.7}, {"stiffness_nm": 5e4, "form": 2.0}
    assert together(bristles, flexspline) == {"coulomb_nm": 0.03, "form": 2.0}


@pytest.mark.parametrize(("channel", "wanted"), [("motor_angle", "right"), ("output_angle", "nothing")])
def test_an_eccentric_encoder_errs_once_in_a_turn_of_its_shaft(channel, wanted):
    one = real("effect", ("sensors", 0.0, 0.0), before=[OWN], order=1.0)
    (said,) = one["verdict"]["effects"]
    said |= {
        "indistinguishable_from": ["kinematic_error"],
        "settings": {channel: {"eccentricity_arcmin": 30.0}},
    }
    assert outcome(one) == wanted
