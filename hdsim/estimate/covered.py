"""What records cover: how far their drive twists and what it carries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hdsim.estimate.predict import Predictor
    from hdsim.estimate.state import State


def covered(predictors: Sequence[Predictor], state: State) -> dict[str, float]:
    """What records cover, by the names that fittings use.

    ``twist_arcmin`` (between 1 % quantiles) where they tell it; ``torque_nm`` and ``motor_side_torque_nm``,
    the largest torque at the output, measured or as the motor's, else the one where the drive's third
    stiffness begins. Of a mesh with teeth the angle between two of each spline, ``flexspline_pitch_deg`` and
    ``circular_spline_pitch_deg``.

    Args:
        predictors: of the records.
        state: the model.
    """
    found = _twists(predictors)
    largest = 0.0
    for predictor in predictors:
        for channel, factor in (("output_torque", 1.0), ("motor_torque", abs(predictor.ratio))):
            if channel in predictor.record.channels and predictor.record.trusted[channel].any():
                values = np.abs(predictor.record.filled(channel))
                largest = max(largest, factor * float(np.quantile(values, 0.99)))
                break
    largest = largest or state.drive.torsion.torque_t2_nm
    if state.toothed:
        geometry = state.drive.geometry
        found["flexspline_pitch_deg"] = 360.0 / geometry.flexspline_teeth
        found["circular_spline_pitch_deg"] = 360.0 / geometry.circular_spline_teeth
    return found | {"torque_nm": largest, "motor_side_torque_nm": largest / abs(predictors[0].ratio)}


def _twists(predictors: Sequence[Predictor]) -> dict[str, float]:
    widest = 0.0
    for predictor in predictors:
        twist = predictor.motor_angle / predictor.ratio
        record = predictor.record
        if not predictor.plan.locked:
            if predictor.plan.motion != "motor_angle" or "output_angle" not in record.channels:
                continue
            twist = twist - record.filled("output_angle")
        low, high = np.quantile(twist, [0.01, 0.99])
        widest = max(widest, float(np.degrees(high - low)) * 60.0)
    return {"twist_arcmin": widest} if widest > 0 else {}
