"""Compiled evaluation of a signal over an array of times (imports numba: load lazily)."""

from __future__ import annotations

import numpy as np

from hdsim._abi import call_signal
from hdsim._compile import compiled


@compiled
def evaluate(address, times, insides, parameters):  # type: ignore[no-untyped-def]
    """Call the signal kernel at ``address`` at each time; returns shape (4, n)."""
    result = np.empty((4, len(times)))
    values = np.empty(4)
    for k in range(len(times)):
        call_signal(address, times[k], insides[k], parameters, values)
        result[:, k] = values
    return result
