import numpy as np
from diagnose_bench import servo_with_arm
from noisy import noisy

import hdsim
from hdsim.diagnosis.again import left_of
from hdsim.diagnosis.screen import Residual, chance_of
from hdsim.diagnosis.traces import screen
from hdsim.effects import catalogue
from hdsim.estimate.opening import bench_for
from hdsim.estimate.refit import refit
from hdsim.estimate.state import state_of

N, BLOCKS = 4000, 40


def blocks() -> np.ndarray:
    return np.arange(N) * BLOCKS // N


def coloured(seed: int) -> np.ndarray:
    """Noise that is correlated over a few samples."""
    white = np.random.default_rng(seed).standard_normal(N + 20)
    return np.convolve(white, np.ones(8) / 8, mode="valid")[:N]


def designs(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng([seed, 1])
    t = np.arange(N) / N
    return [
        np.column_stack([np.sin(f * t + p), np.cos(f * t + p)])
        for f, p in zip(rng.uniform(20, 300, 25), rng.uniform(0, 6, 25), strict=True)
    ]


def test_a_search_over_noise_alarms_at_its_level():
    alarms = 0
    for seed in range(60):
        residual = Residual(coloured(seed), np.ones((N, 1)), blocks(), seed)
        shares = [residual.share(x) for x in designs(seed)]
        alarms += chance_of(max(shares, key=lambda s: s.share), shares) <= 0.05
    # 60 searches at 5 %: more than 8 alarms have a chance below 1 %.
    assert alarms <= 8


def test_a_planted_trace_is_found_with_its_size_and_its_share():
    x = designs(3)[4]
    values = coloured(3) + 0.3 * x[:, 0]
    residual = Residual(values, np.ones((N, 1)), blocks())
    shares = [residual.share(d) for d in designs(3)]
    best = int(np.argmax([s.share for s in shares]))
    assert best == 4
    assert chance_of(shares[4], shares) < 0.01
    np.testing.assert_allclose(shares[4].coefficients, [0.3, 0.0], atol=0.05)
    assert abs(shares[4].share - 0.045 / values.var()) < 0.06


def test_what_the_base_explains_counts_for_nothing():
    x = designs(5)[0]
    residual = Residual(coloured(5) + 5 * x[:, 0], x, blocks())
    assert residual.share(x).share == 0.0
    assert residual.power < 1.2 * float(np.sum(coloured(5) ** 2))


def test_freedom_without_meaning_has_a_negative_share():
    noise = np.random.default_rng(9).standard_normal((N, 30))
    residual = Residual(coloured(8), np.ones((N, 1)), blocks())
    assert residual.share(noise).share < 0.005


def test_an_effect_of_which_one_way_was_tried_is_not_among_those_that_were_not():
    """Seven turns of the wave generator are too few for a sensor's ripple, not for its delay."""
    base = servo_with_arm({"model": "lumped"}, {}, frequency_hz=0.1, duration_s=1.5)
    noise = {"motor_angle": 2e-5, "output_angle": 2e-6, "motor_torque": 6e-3}
    bench = bench_for([noisy(hdsim.simulate(base), noise, seed=0)], [], base)
    found = refit(bench, state_of(base)).fit
    screening = screen(bench, found.state, left_of(bench, found), [])
    tried = {one.name for one in screening.ranked}
    assert "sensors" in tried
    assert tried.isdisjoint(screening.skipped)
    assert tried | set(screening.skipped) == set(catalogue())
