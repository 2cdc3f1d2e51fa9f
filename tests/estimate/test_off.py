"""Which numbers are said to be wrong: those that explain what a re-fit did, not what is off by chance."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdsim.estimate.numbers import Interval
from hdsim.estimate.off import wrong_numbers

RNG = np.random.default_rng(4)
GAIN, LOSS, INERTIA = "motor_torque_gain", "drive.friction.load_coefficient", "drive.inertia.motor_kg_m2"


def said(moves: dict[str, float], intervals: list[Interval]) -> tuple[list[str], bool]:
    """What is said of a fit that has moved these numbers, whose sensitivities are independent."""
    names = [interval.name for interval in intervals]
    columns = RNG.standard_normal((4000, len(names)))
    change = columns @ np.array([moves.get(name, 0.0) for name in names])
    frees = [SimpleNamespace(name=name) for name in names]
    found = SimpleNamespace(columns=columns, frees=frees, beside=None, undetermined=[], predictions=change)
    bench = SimpleNamespace(trace=lambda before, after: after)
    off = wrong_numbers(bench, [], found, intervals)
    return [one.name for one in off], all(one.moved for one in off)


def interval(name: str, low: float, high: float, *, determined: bool = True) -> Interval:
    return Interval(name, 0.5 * (low + high), 1.0, low, high, determined=determined)


def test_a_number_that_is_outside_by_chance_is_not_the_wrong_one():
    # A torque constant 9 % too large moved all, but nothing bounds it; a loss lies outside by two deviations.
    numbers = [interval(GAIN, np.nan, np.nan, determined=False), interval(LOSS, 0.93, 0.99)]
    assert said({GAIN: 0.09, LOSS: -0.01}, numbers) == ([GAIN], False)


def test_numbers_that_explain_what_the_fit_did_are_wrong_all_of_them():
    numbers = [interval(INERTIA, 1.1, 1.3), interval(LOSS, 0.8, 0.9), interval(GAIN, 0.9, 1.1)]
    assert said({INERTIA: 0.2, LOSS: -0.15, GAIN: 0.02}, numbers) == ([INERTIA, LOSS], True)


def test_where_none_lies_outside_those_that_could_have_done_most_alone_are_named():
    numbers = [interval(INERTIA, 0.9, 1.3), interval(GAIN, 0.9, 1.3), interval(LOSS, 0.9, 1.1)]
    off, sure = said({INERTIA: 0.1, GAIN: 0.099}, numbers)
    assert sorted(off) == sorted([INERTIA, GAIN])
    assert not sure
    assert said({}, [])[0] == []


@pytest.mark.parametrize("part", [0.4, 0.6])
def test_most_is_more_than_all_others(part):
    numbers = [interval(LOSS, 1.01, 1.2), interval(GAIN, 0.5, 1.5)]
    off, sure = said({LOSS: np.sqrt(part), GAIN: np.sqrt(1.0 - part)}, numbers)
    assert (off, sure) == (([LOSS], True) if part > 0.5 else ([GAIN], False))


def test_a_number_that_makes_up_for_what_the_motion_lacks_is_not_the_wrong_one():
    made_up = replace(interval(LOSS, np.nan, np.nan, determined=False), resolved=False)
    assert said({LOSS: 0.1}, [made_up])[0] == []
    off, sure = said({LOSS: 0.1, GAIN: 0.095}, [made_up, interval(GAIN, 0.9, 1.3)])
    assert (off, sure) == ([GAIN], False)
