"""Where a locked drive carries nothing, as its own torques tell.

A torque sensor at the output reads what the spring carries: the angle over it crosses zero there. The motor's
torque holds its friction as well, which leads to two branches.
"""

from __future__ import annotations

import numpy as np

from hdsim.estimate.records import Array, Record

#: Part of the largest torque within which the angle is a straight line over it, or is one of the branches'.
STRAIGHT, SMALL = 0.2, 0.05


def unloaded_angle(record: Record, angle: Array) -> float:
    """Motor angle of a locked drive where it carries nothing, rad (0 without a torque).

    Args:
        record: the measured run.
        angle: motor angle beside the output, shape (n,).
    """
    if "output_torque" in record.readable:
        torque = record.filled("output_torque")
        near = np.abs(torque) < STRAIGHT * np.max(np.abs(torque))
        if near.sum() > 2 and np.ptp(torque[near]) > 0:
            _, intercept = np.polyfit(torque[near], angle[near], 1)
            # A narrow range far from zero says nothing of what lies there.
            if torque[near].min() < 0.0 < torque[near].max():
                return float(intercept)
    if "motor_torque" in record.readable:
        torque = record.filled("motor_torque")
        near = np.abs(torque) < SMALL * np.max(np.abs(torque))
        if near.any():
            low, high = np.quantile(angle[near], [0.05, 0.95])
            return float(0.5 * (low + high))
    return 0.0
