"""An encoder that loses counts: said as a problem of the data, and taken back."""

import numpy as np
import pytest
from moves import NOISE, SWINGING
from noisy import noisy

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.jumps import ALL, best_step
from hdsim.scenario import Scenario

JUMP_RAD, AT_S = 2e-4, 4.2


@pytest.mark.parametrize(
    ("left", "jumps"),
    [
        (lambda t: 5.0 * (t > 0.4), True),
        (lambda t: 5.0 * t, False),  # a drift
        (lambda t: 5.0 * np.sign(np.sin(9.0 * t)), False),  # a play, which changes sides
        (lambda t: 60.0 * (t > 0.9985), False),  # two samples at the end
        (lambda t: 0.0 * t, False),
    ],
)
def test_a_step_alone_is_a_jump(left, jumps):
    t = np.linspace(0.0, 1.0, 1000)
    first, size, part = best_step(left(t) + np.random.default_rng(2).standard_normal(1000), 1.0)
    assert (part > ALL and abs(size) > 1.0) == jumps
    if jumps:
        assert t[first] == pytest.approx(0.4, abs=2e-3)
        assert size == pytest.approx(5.0, abs=0.3)


@pytest.mark.slow
def test_a_drive_whose_encoder_loses_counts_lacks_nothing():
    """Seen without: "unknown", and 4 to 6 times the noise left."""
    base = Scenario.model_validate(SWINGING)
    record = noisy(hdsim.simulate(base), NOISE, seed=3)
    as_read = record.channels["output_angle"] + JUMP_RAD * (record.time > AT_S)
    record.channels["output_angle"] = as_read
    verdict = diagnose([record], base).verdict
    assert verdict.verdict == "nothing"
    assert all(gap.after < 1.1 * gap.noise for gap in verdict.gap.values())
    (problem,) = (p for p in verdict.data_problems if p.kind == "jump")
    assert problem.channel == "output_angle"
    assert "jumps by 0.0002 rad at 4.202 s" in problem.message
    assert record.channels["output_angle"] is as_read
