"""How finely an encoder of the output tells the rotor's motion: as finely as the motor's torque answers it.

Behind the ratio every error of the output's encoder is a hundred times as large, and what the output does
beyond the drive's own resonance the rotor does not. Cross-validation follows both, as they repeat from sample
to sample. An acceleration of which the part lambda of the variance is the rotor's is answered by lambda times
the torque (reliability ratio: W. A. Fuller, *Measurement Error Models*, Wiley 1987, section 1.1), so the
inertia that least squares find along a fine spline, over that of a slow one, is lambda. The fine one leaves
1 - lambda of its variance as error; the slow one leaves what the rotor does faster, lambda of it less its own
variance. The fine one is taken where that is more even at the least lambda that the data allow.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hdsim.estimate.baseline import beside_inertia
from hdsim.estimate.knots import uniform
from hdsim.estimate.records import Array

if TYPE_CHECKING:
    from hdsim.estimate.bench import Bench
    from hdsim.estimate.predict import Predictor
    from hdsim.estimate.state import State

#: Time between the knots of a slow motion, s. Along the recordings of five joints of a Kinova Gen3 the
#: inertia no longer depends on it from 14 ms on, and 14 to 30 ms give the same effects, but for a weak ripple
#: of joint 4, which is found from 20 ms on.
APART_S = 0.02
#: Standard errors of the inertia along the slow motion by which it must be told from none, and may be larger.
TOLD = 2.0
#: Part of an acceleration's variance from which on it is right, as those of noiseless simulated records are.
RIGHT = 0.9


def knots_apart_s(bench: Bench, state: State) -> float:
    """Least time between knots of motions that the output's encoder tells, s; 0 where finer ones are right.

    Args:
        bench: the measured series; only what fits see is looked at.
        state: the model as given; the inertia of its rotor counts where the slow motion tells none.
    """
    sums, missed, independent = np.zeros((2, 2)), 0.0, 0.0
    for series in bench.series:
        predictor = bench.predictors[series.record]
        plan, rows = predictor.plan, series.train
        if series.channel != "motor_torque" or plan.locked or plan.motion != "output_angle" or not rows.any():
            continue
        slow = None if predictor.likeliest else _slow(predictor)
        if slow is None:
            continue
        values = np.column_stack([series.measured, predictor.motor_acceleration, slow])[rows]
        beside = np.column_stack([np.ones(len(slow)), beside_inertia(predictor, state)])[rows]
        values -= beside @ np.linalg.lstsq(beside, values, rcond=None)[0]
        torque, accelerations = values[:, 0], values[:, 1:]
        sums += np.array([accelerations.T @ torque, (accelerations**2).sum(axis=0)])
        missed += float(torque @ torque)
        independent += predictor.record.duration_s * float(rows.mean()) / APART_S
    (fast_along, slow_along), (fast_power, slow_power) = sums
    if not slow_power or not fast_power:
        return 0.0
    inertia = slow_along / slow_power
    error = math.sqrt(max(missed - inertia * slow_along, 0.0) / independent / slow_power)
    if inertia < TOLD * error:
        inertia, error = state.drive.inertia.rotor_kg_m2, 0.0
    known = fast_along / fast_power / (inertia + TOLD * error)
    return 0.0 if known > RIGHT or (2.0 * known - 1.0) * fast_power > slow_power else APART_S


def _slow(predictor: Predictor) -> Array | None:
    """Acceleration of the motor along few knots, (n,); None where the motion has no more or none can be."""
    record = predictor.record
    spacing = APART_S / record.period_s
    if len(record.time) < 5.0 * spacing or spacing <= predictor.samples_a_knot:
        return None
    spline = uniform(record.time, record.filled("output_angle"), spacing)
    return None if spline is None else np.asarray(predictor.ratio * spline(record.time, nu=2))
