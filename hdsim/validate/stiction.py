"""Exact stiction of one inertia, found from event to event: a second solution for hdsim's friction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def exact_stiction(
    torque: Callable[[Array], Array], duration_s: float, coulomb_nm: float, viscous: float, inertia: float
) -> tuple[Array, Array, float]:
    """Motion from rest under a torque: stuck until the torque is above the Coulomb friction, then free.

    Each slip is integrated by SciPy's RK45 at 1e-10 until its speed comes back to zero, which an event finds.

    Args:
        torque: in N m, of a time in s.
        duration_s: length, s.
        coulomb_nm: Coulomb friction, N m, the same at rest.
        viscous: N m s/rad.
        inertia: kg m^2.

    Returns:
        Times at 1 kHz in s, angles in rad, both of shape (n,), and the share of the time that it is stuck.
    """
    from scipy.integrate import solve_ivp

    times = np.arange(round(1000 * duration_s) + 1) / 1000
    found, time, angle, stuck = np.zeros(len(times)), 0.0, 0.0, 0.0
    while time < duration_s:
        fine = np.linspace(time, duration_s, 200_001)
        above = np.flatnonzero(np.abs(torque(fine)) > coulomb_nm)
        begin = float(fine[above[0]]) if len(above) else duration_s
        found[times >= time] = angle
        stuck += begin - time
        if begin >= duration_s:
            break
        sign = float(np.sign(torque(np.array(begin))))

        def rates(t: float, y: Array, sign: float = sign) -> list[float]:
            return [y[1], (float(torque(np.array(t))) - sign * coulomb_nm - viscous * y[1]) / inertia]

        def stops(t: float, y: Array, sign: float = sign, begin: float = begin) -> float:
            return float(sign * y[1] + (1e-9 if t < begin + 1e-3 else 0.0))

        stops.terminal, stops.direction = True, -1  # type: ignore[attr-defined]
        slip = solve_ivp(
            rates, (begin, duration_s), [angle, 0.0], events=stops, dense_output=True, rtol=1e-10, atol=1e-13,
            max_step=1e-3,
        )  # fmt: skip
        time, angle = float(slip.t[-1]), float(slip.y[0, -1])
        inside = (times >= begin) & (times <= time)
        found[inside] = slip.sol(times[inside])[0]
    return times, found, stuck / duration_s
