"""Covariance by leaving out blocks of time, where one block is all that tells of a number."""

import math

import numpy as np
import pytest

from hdsim.estimate.covariance import robust_covariance

BLOCKS = np.repeat(np.arange(20), 50)
REST = np.random.default_rng(0).standard_normal(len(BLOCKS))
LEVEL = np.ones(len(BLOCKS))


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_a_number_that_one_block_tells_of_is_as_good_as_unknown_without_it(size):
    alone = size * (BLOCKS == 7) * np.sin(np.arange(len(BLOCKS)))
    priors = np.full(2, math.inf)
    found = robust_covariance(np.column_stack([LEVEL, alone]), REST, BLOCKS, priors)
    assert np.isfinite(found).all()
    assert math.sqrt(found[1, 1]) > 1e3 / size
    # The level is told by all blocks: 1/sqrt(1000) but for one block's worth.
    assert math.sqrt(found[0, 0]) == pytest.approx(len(BLOCKS) ** -0.5, rel=0.5)


@pytest.mark.parametrize("spread", [2.0, math.inf])
def test_a_number_that_nothing_tells_of_keeps_its_prior(spread):
    columns = np.column_stack([LEVEL, np.zeros(len(BLOCKS))])
    found = robust_covariance(columns, REST, BLOCKS, np.array([math.inf, spread]))
    assert np.isfinite(found).all()
    assert math.sqrt(found[1, 1]) >= 0.9 * min(spread, 1e3)
