"""What a model lacks widens the intervals of the numbers that it has bent, and of no others."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "estimate"))
from rig import TRUTH, model, record

import hdsim
from hdsim.diagnosis.discrepancy import discrepancy
from hdsim.diagnosis.locate import locate
from hdsim.diagnosis.search import left_of
from hdsim.estimate.drift import drifted
from hdsim.estimate.fit import base_intervals

#: A tenth of the weight.
CATCH_NM = 0.013


def _asked(found):
    """The located remainder's columns, and the intervals without and with them, by name."""
    bench, fit = found.bench, found.fit
    residuals = bench.residuals(fit.predictions, drift=True)
    location = locate(bench, left_of(bench, fit), residuals, fit.state.delays)
    left = discrepancy(bench, fit, location)
    wider = drifted(bench, fit, left)
    starts = found.refit.freedoms
    return left, *({i.name: i for i in base_intervals(each, starts)} for each in (fit, wider))


def _caught(seed):
    """A spring catch over a part of the output's turn, seen by the motor: no law of the model has it."""
    one = record(seed, 4.0)
    away = (one.channels["output_angle"] + 0.4) / 0.15
    torque = one.channels["motor_torque"] + CATCH_NM * away * np.exp(0.5 - 0.5 * away**2)
    return replace(one, channels=one.channels | {"motor_torque": torque})


@pytest.mark.slow
def test_a_law_that_is_missing_widens_what_it_has_bent(tmp_path):
    found = hdsim.fit([_caught(3)], model(tmp_path), fix=["motor_torque_gain"])
    left, narrow, wide = _asked(found)
    assert left[0].T @ left[0] == pytest.approx(np.eye(left[0].shape[1]), abs=1e-8)
    assert [n for n, truth in TRUTH.items() if not narrow[n].low <= truth <= narrow[n].high]
    for name, truth in TRUTH.items():
        # What cannot be told from a curve over the output's angle is not identifiable at all.
        assert not wide[name].determined or wide[name].low <= truth <= wide[name].high, name


def test_noise_alone_widens_nothing(tmp_path):
    found = hdsim.fit([record(3, 4.0)], model(tmp_path), fix=["motor_torque_gain"])
    left, narrow, wide = _asked(found)
    assert left[0].shape[1] == len(left[1]) == 0
    assert {n: (i.low, i.high) for n, i in wide.items()} == {n: (i.low, i.high) for n, i in narrow.items()}
