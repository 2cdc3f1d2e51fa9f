"""Covariance by leaving out blocks of time, where one block is all that tells of a number."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter

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


def held_beside(seed):
    """Error and stated spread of an amplitude of 1.5 whose gain is believed to 15 % and held at none.

    What else the gain does is slow, as the noise is: to white noise it would tell the gain to 1 %.
    """
    rng, time = np.random.default_rng(seed), np.linspace(0.0, 1.0, 8000)
    noise = lfilter([0.2], [1.0, -0.98], rng.standard_normal(len(time)))
    wave = np.sin(40.0 * np.pi * time)
    gain = 1.5 * wave + 0.25 * np.cos(6.0 * np.pi * time)
    measured = 1.5 * wave + 0.15 * rng.standard_normal() * gain + noise
    size = float(wave @ measured / (wave @ wave))
    beside = gain[:, None], np.array([0.15])
    blocks = np.arange(len(time)) // 200
    found = robust_covariance(wave[:, None], measured - size * wave, blocks, np.array([math.inf]), beside)
    return size - 1.5, math.sqrt(found[0, 0])


def test_an_interval_beside_a_number_that_is_held_covers_as_often_as_it_says():
    draws = np.array([held_beside(seed) for seed in range(60)])
    error = float(np.sqrt(np.mean(draws[:, 0] ** 2)))
    # Noise of 0.12 and 15 % of 1.5. A spread of a root mean square of 60 draws is known to a tenth.
    assert error == pytest.approx(math.hypot(0.12, 0.225), rel=0.3)
    assert float(np.median(draws[:, 1])) == pytest.approx(error, rel=0.3)
    assert np.mean(np.abs(draws[:, 0]) < 2.0 * draws[:, 1]) > 0.85
