"""An initial-value problem whose right-hand side is a compiled system kernel."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from hdsim.kernel import Kernel

Array = NDArray[np.float64]


@dataclass
class System:
    """y' = f(t, y) with its Jacobian and time derivative, as ``hdsim.kernel.system`` defines them.

    Args:
        kernel: the system kernel.
        integers: int64 numbers of the kernel, contiguous.
        reals: float64 numbers of the kernel, contiguous. Whoever runs the system may change them between
            calls (the held torque of a sampled controller, the current smooth span).
        scratch_size: number of float64 of scratch that the kernel needs; one array a caller, so that
            runs in threads don't share one.
        y0: initial state, shape (n,).
        quadratures: number of trailing states that no right-hand side reads (energies): a solver may
            leave them out of its linear algebra.
        scale: shape (n,); absolute tolerance is rtol times this, unless the user sets one.
    """

    kernel: Kernel
    integers: NDArray[np.int64]
    reals: Array
    scratch_size: int
    y0: Array
    quadratures: int = 0
    scale: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.y0)

    def __post_init__(self) -> None:
        from hdsim import _evaluate

        self._call = _evaluate.evaluate
        n = self.size
        self._scratch = np.zeros(max(1, self.scratch_size))
        self._jacobian = np.zeros((n, n))
        self._dfdt = np.zeros(n)

    def evaluate(self, t: float, y: Array) -> tuple[Array, Array, Array]:
        """Right-hand side (n,), Jacobian (n, n) and partial time derivative (n,) at (t, y)."""
        n = self.size
        dy, jacobian, dfdt = np.zeros(n), np.zeros((n, n)), np.zeros(n)
        self._call(self.kernel.address, t, y, self.integers, self.reals, self._scratch, 1, dy, jacobian, dfdt)
        return dy, jacobian, dfdt

    def rhs(self, t: float, y: Array) -> Array:
        """Right-hand side, shape (n,); the signature that ``solve_ivp`` wants."""
        dy = np.empty(self.size)
        y = np.ascontiguousarray(y)
        self._call(
            self.kernel.address,
            t,
            y,
            self.integers,
            self.reals,
            self._scratch,
            0,
            dy,
            self._jacobian,
            self._dfdt,
        )
        return dy

    def jacobian(self, t: float, y: Array) -> Array:
        """Jacobian df/dy, shape (n, n)."""
        return self.evaluate(t, np.ascontiguousarray(y))[1]
