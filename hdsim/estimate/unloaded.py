"""Where a locked drive carries nothing, as its own torques tell.

A torque sensor at the output reads what the spring carries; the motor's torque holds its friction as well.
"""

from __future__ import annotations

import numpy as np

from hdsim.estimate.records import Array, Record

#: Part of the largest torque within which the angle is one of the branches'.
SMALL = 0.05


def unloaded_angle(record: Record, angle: Array) -> float:
    """Motor angle of a locked drive midway between its branches at zero torque, rad (0 without a torque).

    Args:
        record: the measured run.
        angle: motor angle beside the output, shape (n,).
    """
    for channel in ("output_torque", "motor_torque"):
        if channel in record.readable:
            torque = record.filled(channel)
            small = np.abs(torque) < SMALL * np.max(np.abs(torque))
            if small.any():
                low, high = np.quantile(angle[small], [0.05, 0.95])
                return float(0.5 * (low + high))
    return 0.0
