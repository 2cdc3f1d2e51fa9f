"""Controllers that run at a sample period and hold their torque in between."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

import numpy as np

from hdsim.actuation.canonical import INPUTS, CanonicalController

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hdsim.actuation.signal_data import SignalData

    Array = NDArray[np.float64]


class SampledController:
    """A controller discretised by ``control.sample_system``.

    x[k+1] = A_d x[k] + B_d w[k] + T_s L (T - u), u = C_d x[k] + D_d w[k], T = u limited. When ``clamps``,
    the integrators are not advanced in a sample in which the torque is limited and they would drive it
    further beyond the limit (conditional integration; Astrom and Hagglund 1995, sec. 3.5).

    Args:
        controller: the continuous controller.
        reference: the reference signal, SI units.
        order: 0 when the reference is an angle, 1 when it is a velocity.
        period: sample period in s.
        method: ``zoh`` or ``tustin``.
        limit: torque limit in N m, may be infinite.
        clamps: whether the integrators stop at the limit.
    """

    def __init__(
        self,
        controller: CanonicalController,
        reference: SignalData,
        *,
        order: int,
        period: float,
        method: Literal["zoh", "tustin"],
        limit: float,
        clamps: bool,
    ) -> None:
        self.period = period
        self.limit = limit
        self._reference = reference
        self._order = order
        self._A, self._B = controller.A, controller.B
        self._C, self._D = controller.C, controller.D
        n = len(controller.C)
        if n:
            import control as ct

            plain = ct.ss(controller.A, controller.B, controller.C[None, :], controller.D[None, :])
            sampled = ct.sample_system(plain, period, method)
            self._A, self._B = np.asarray(sampled.A), np.asarray(sampled.B)
            self._C, self._D = np.asarray(sampled.C).ravel(), np.asarray(sampled.D).ravel()
        clamped = clamps and bool(controller.integrators.any())
        self._integrators = controller.integrators if clamped else np.zeros(n, dtype=bool)
        self._tracking = np.zeros(n) if clamped else period * controller.L
        self.state: Array = np.zeros(n)

    def reset(self) -> None:
        """Back to the state before the first sample."""
        self.state = np.zeros(len(self._C))

    def update(self, time: float, measured: Mapping[str, float]) -> float:
        """One sample: the torque to hold from ``time`` on, in N m.

        Args:
            time: s; a reference that jumps here has jumped already.
            measured: ``motor_angle``, ``motor_velocity``, ``output_angle``, ``output_velocity``, SI units.
        """
        # Sample times carry rounding: look a little ahead for the piece of the reference.
        reference = self._reference.values([time], [time + 1e-6 * self.period])[:, 0]
        w = np.zeros(len(INPUTS))
        w[self._order : 3] = reference[: 3 - self._order]
        w[3:] = [measured[name] for name in INPUTS[3:]]
        wanted = float(self._C @ self.state + self._D @ w)
        torque = min(max(wanted, -self.limit), self.limit)
        following = self._A @ self.state + self._B @ w + self._tracking * (torque - wanted)
        if torque != wanted and self._integrators.any():
            growth = float(self._C[self._integrators] @ (following - self.state)[self._integrators])
            if growth * wanted > 0.0:
                following[self._integrators] = self.state[self._integrators]
        self.state = following
        return torque
