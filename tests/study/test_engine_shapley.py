"""Shapley's shares against games whose answer is known in closed form."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.studies.engine.shapley import coalitions, drawn_orders, shapley_shares


def test_the_glove_game():
    # One left glove (a), two right ones (b, c); a pair is worth 1: a 2/3, b and c 1/6 (a textbook's game).
    value = {s: float("a" in s and bool({"b", "c"} & s)) for s in coalitions("abc")}
    found = shapley_shares("abc", value)
    assert [found[x].value for x in "abc"] == pytest.approx([2 / 3, 1 / 6, 1 / 6])


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(-10, 10), min_size=4, max_size=4), st.floats(-10, 10), st.floats(-10, 10))
def test_what_two_causes_make_together_is_halved_and_all_sums_to_the_whole(own, together, rest):
    names = "abcd"
    weight = dict(zip(names, own, strict=True))
    value = {s: rest + sum(weight[x] for x in s) + together * ({"a", "b"} <= s) for s in coalitions(names)}
    found = shapley_shares(names, value)
    half = together / 2
    expected = [own[0] + half, own[1] + half, own[2], own[3]]
    assert [found[x].value for x in names] == pytest.approx(expected, abs=1e-9)


def test_drawn_orders_meet_the_exact_shares_within_their_error_and_keep_the_sum():
    names = "abcdefgh"
    value = {s: math.sin(sum(map(ord, s))) * len(s) ** 1.5 for s in coalitions(names)}
    exact = shapley_shares(names, value)
    orders = drawn_orders(names, 400)
    assert set(coalitions(names, orders)) <= set(value)
    found = shapley_shares(names, value, orders)
    for x in names:
        assert abs(found[x].value - exact[x].value) < 4 * found[x].standard_error
        assert 0 < found[x].standard_error < 1.0
    assert sum(one.value for one in found.values()) == pytest.approx(value[frozenset(names)])
