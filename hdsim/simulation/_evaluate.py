"""The compiled bridge from Python to a system kernel (imports numba: load lazily)."""

from __future__ import annotations

from numba import njit

from hdsim._abi import call_system


@njit(cache=True, nogil=True)
def evaluate(address, t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Call the system kernel at ``address``."""
    call_system(address, t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt)
