"""How large a compliance in series is, found by itself before anything else is fitted.

It moves the resonance, so what it leaves is far from quadratic in its size, and a linear fit of all numbers
at once takes the drive's own stiffness, its damping and the load's inertia along to where they do not lie.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.diagnosis.point import Point
from hdsim.estimate.bench import Bench
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.state import Added

#: Compliances in units of the drive's own between which the best is searched for, the factor from one to the
#: next, and the logarithm to which it is found.
SCANNED, SCANNED_BY, NEAR_ENOUGH = (0.25, 0.5, 1.0, 2.0, 4.0), 2.0, 0.03


def softest(bench: Bench, point: Point, added: Added, columns: Array, stiff: Mask) -> float | None:
    """Coefficient of the compliance that leaves least beside the base's own numbers.

    One as large as the drive's own moves the resonance so far that no linear fit finds it.

    Args:
        bench: the measured series.
        point: where the base is.
        added: the effect.
        columns: its trace there, shape (rows, 1).
        stiff: which of the point's numbers are stiffnesses, shape (p,).

    Returns:
        None where none leaves less than the base does.
    """
    from scipy.optimize import minimize_scalar

    trace = columns[:, 0]
    own = -float(trace @ point.columns @ stiff) / float(trace @ trace)
    if not own > 0:
        return None

    def left(parts: Sequence[float]) -> list[float]:
        several = [replace(added, coefficients=(part * own,)) for part in parts]
        states = [replace(point.state, added=(*point.state.added, one)) for one in several]
        return [math.inf if there is None else bench.power(there) for there in bench.predict_all(states)]

    powers = left(SCANNED)
    best = SCANNED[int(np.argmin(powers))]
    if not min(powers) < bench.power(point.predictions):
        return None
    bounds = math.log(best / SCANNED_BY), math.log(best * SCANNED_BY)
    found = minimize_scalar(
        lambda log: left([math.exp(log)])[0], bounds=bounds, method="bounded", options={"xatol": NEAR_ENOUGH}
    )
    return own * (math.exp(float(found.x)) if found.fun < min(powers) else best)
