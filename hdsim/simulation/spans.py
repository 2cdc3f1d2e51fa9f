"""Where an integration is cut, and where its steps end."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from hdsim.actuation.signal_data import SignalData
    from hdsim.drive.model import Model

Array = NDArray[np.float64]


def cuts(signals: Iterable[SignalData], duration_s: float, *further: Array) -> Array:
    """Times from 0 to the duration between which nothing jumps, shape (spans + 1,), s.

    Args:
        signals: their corners are cuts.
        duration_s: the end.
        further: other times to cut at, s.
    """
    corners = [np.asarray(signal.corners(0.0, duration_s)) for signal in signals]
    times = np.unique(np.concatenate([np.array([0.0, duration_s]), *corners, *further]))
    times = times[(times >= 0.0) & (times <= duration_s)]
    keep = np.concatenate([[True], np.diff(times) > 1e-12 * max(1.0, duration_s)])
    times = times[keep]
    times[-1] = duration_s
    return np.asarray(times)


def stops(model: Model, duration_s: float) -> Array:
    """Times at which a prescribed motion's third derivative jumps, shape (k,), s: steps end there."""
    joints = [signal.joints(0.0, duration_s) for signal in model.motions.values()]
    return np.unique(np.concatenate([np.zeros(0), *joints]))
