"""The compiled bridge from Python to a system kernel (imports numba: load lazily)."""

from __future__ import annotations

from hdsim._abi import call_system
from hdsim._compile import compiled


@compiled
def evaluate(address, t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Call the system kernel at ``address``."""
    call_system(address, t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt)
