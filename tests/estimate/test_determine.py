"""Which numbers the data determine: the same ones whatever the last digits are."""

import numpy as np
import pytest

from hdsim.estimate.determine import determined


@pytest.mark.parametrize("rounding", [-1e-12, 0.0, 1e-12])
def test_of_two_numbers_that_do_the_same_the_later_one_goes_whatever_rounding_says(rounding):
    """The inertias of motor and load in a rigid drive."""
    rng = np.random.default_rng(0)
    t = np.linspace(0.0, 20.0, 2000)
    one = 50.0 * np.sin(3.0 * t)
    columns = np.column_stack([one, (1.0 + rounding) * one, 40.0 * np.cos(1.7 * t)])
    rest = rng.standard_normal(len(t))
    split = determined(columns, rest, np.full(3, 0.5), np.arange(len(t)) // 100, 3)
    assert split.kept == [0, 2]
    assert split.dropped == [1]
    assert split.ties == {1: [0]}
