"""Drawn cases: the same from the same numbers, as wide as the page says, with the strength they claim."""

from functools import cache
from pathlib import Path

import family_numpy as family
import numpy as np
import pytest
from drives import LEAST_FACTOR, MOST_FACTOR
from hidden import EFFECTS, KINDS_OF
from outside import OUTSIDE
from running import Task, base_of, drawn, keep, task_of
from sensing import SENSORS

from hdsim.effects import catalogue

#: Quick ones of each kind but the parameter's; the quickest first.
QUICK = (3, 7, 4)


@cache
def drawn_once(number: int):
    """The case of seed 0, which more than one test looks at."""
    return family.draw(number, 0)


def wanted(number: int, seed: int):
    return family.wanted_of(number, seed, np.random.default_rng([1, seed, number]))


def test_every_effect_of_the_catalogue_that_can_be_fitted_is_hidden_and_none_has_no_limit():
    named = {name for effect in EFFECTS for name in (effect.accepted or (effect.name,))}
    named |= {name for effect in OUTSIDE for name in effect.accepted}
    # What only teeth have is hidden by a family of its own.
    asked = {
        name
        for name, effect in catalogue().items()
        if any(fitting.mesh != "toothed" for fitting in effect.fittings)
    }
    assert named >= asked
    of_teeth = {"flank_wear", "mesh_preload", "tooth_error"}
    assert {name for name, effect in catalogue().items() if effect.fittings} - asked == of_teeth
    assert all(h.limit for h in (*EFFECTS, *OUTSIDE))
    assert {name for kind in KINDS_OF for name in kind} == {h.name for h in EFFECTS}


def test_what_is_wanted_is_as_wide_as_it_says():
    drawn = [wanted(n, seed) for seed in (0, 1) for n in range(400)]
    count = {kind: sum(w.kind == kind for w in drawn) for kind in family.KINDS}
    assert count == {"null": 200, "parameter": 80, "effect": 360, "pair": 80, "outside": 80}
    strengths = np.log([w.strengths[0] for w in drawn if w.kind == "effect"])
    low, high = np.log(family.STRENGTH)
    assert strengths.min() < low + 0.1
    assert strengths.max() > high - 0.1
    assert np.quantile(strengths, 0.5) == pytest.approx((low + high) / 2, abs=0.5)
    assert all(low <= s <= high for s in strengths)
    assert sum(w.same for w in drawn) == pytest.approx(400, abs=60)
    # In one seed every effect has its turn, before any has its second or third.
    names = [w.hidden[0].name for w in drawn[: len(drawn) // 2] if w.kind == "effect"]
    assert {names.count(h.name) for h in EFFECTS} <= {len(names) // len(EFFECTS) + k for k in (0, 1)}
    assert all(0.05 <= abs(by - 1.0) <= 0.3 for w in drawn for by in w.off_by)


def test_setups_stay_within_the_stated_ranges():
    rng = np.random.default_rng(5)
    rates, files, jitters = [], 0, 0
    for number in range(300):
        asked = wanted(number, 1)
        setups, held = family._setups(asked, rng, 0)
        first = setups[0]
        rates.append(first.rate)
        files += bool(held)
        jitters += first.jitter > 0
        assert family.RATE_HZ[0] - 1 <= first.rate <= family.RATE_HZ[1] + 1
        assert float(10000.0 / first.rate) == pytest.approx(round(10000.0 / first.rate))
        assert family.STEP[0] <= first.step <= family.STEP[1]
        assert all(5.0 <= s.seconds <= family.LONG_SECONDS[1] for s in (*setups, *held))
        assert 1 <= len(setups) <= 4
        assert len(held) <= 2
        assert first.sensors in SENSORS
        assert len({(s.motion == "locked") for s in (*setups, *held)}) == 1
        assert len({s.seed for s in (*setups, *held)}) == len(setups) + len(held)
        assert all(s.motion in h.motions for h in asked.hidden for s in (*setups, *held))
    assert min(rates) < 130
    assert max(rates) > 4000
    assert files / 300 == pytest.approx(family.FILES_SHARE, abs=0.09)
    assert jitters / 300 == pytest.approx(family.JITTER_SHARE, abs=0.07)


@pytest.mark.slow
@pytest.mark.parametrize("number", [QUICK[0], *(pytest.param(n, marks=pytest.mark.study) for n in QUICK[1:])])
def test_a_case_follows_from_its_key(number):
    first = drawn_once(number)
    task = task_of(first.key)
    again = family.draw(task.number, task.seed)
    assert first.key == again.key
    assert first.base == again.base
    assert first.strength == again.strength
    for one, other in zip((*first.records, *first.holdout), (*again.records, *again.holdout), strict=True):
        assert np.array_equal(one.time, other.time)
        assert all(np.array_equal(one.channels[c], other.channels[c]) for c in one.channels)
    assert family.draw(number, 6).base != first.base
    assert first.family == "numpy"
    assert base_of(first).drive.mesh.model == "lumped"
    for record in (*first.records, *first.holdout):
        assert np.all(np.diff(record.time) > 0)
        assert set(record.channels) == set(SENSORS[first.setup["sensors"]]) | (
            {"temperature"} if first.setup["temperature"] else set()
        )
    # Held-out files are other motions.
    assert (
        not set(first.setup["motion"]) & set(first.setup["held_motion"]) or "locked" in first.setup["motion"]
    )


@pytest.mark.slow
def test_a_strength_is_the_one_that_was_reached():
    """By the records themselves, without the sizing: the trace in the channel where it is largest."""
    case = drawn_once(4)
    asked = wanted_of_draw(4, 0)
    assert case.strength[0] == pytest.approx(asked.strengths[0], rel=0.35)
    assert case.setup["plain_strength"][0] >= case.strength[0]


def wanted_of_draw(number: int, seed: int):
    import zlib

    return family.wanted_of(
        number, seed, np.random.default_rng([zlib.crc32(family.FAMILY.encode()), seed, number])
    )


def test_drives_stay_within_their_factors():
    from drives import DRIVES, around

    low, high = around(DRIVES[0], (0.0,) * 8), around(DRIVES[0], (1.0,) * 8)
    assert low.coulomb == pytest.approx(LEAST_FACTOR * DRIVES[0].coulomb)
    assert high.stiffness[2] == pytest.approx(MOST_FACTOR * DRIVES[0].stiffness[2])
    assert Path(__file__).with_name("contract.py").exists()


@pytest.mark.slow
def test_a_kept_case_is_the_drawn_one_and_not_drawn_again(tmp_path, monkeypatch):
    task = Task("numpy", 7, 0, cases=tmp_path)
    key = keep(task)["key"]
    monkeypatch.setattr(family, "draw", None)
    again = drawn(task)
    assert again.key == key
    monkeypatch.undo()
    fresh = drawn_once(7)
    assert again.base == fresh.base
    for one, other in zip(again.records, fresh.records, strict=True):
        assert all(np.array_equal(one.channels[c], other.channels[c]) for c in other.channels)
