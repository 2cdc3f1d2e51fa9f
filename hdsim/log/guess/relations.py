"""How the numbers of two columns hang together: one times a factor, one the derivative of the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Share of the variance that a relation must explain to count as one.
CLEAR = 0.995
_TRIMMED = 1e-3


@dataclass(frozen=True)
class Slope:
    """y = factor x + constant, in recorded units.

    Args:
        factor: by least squares.
        explained: share of the variance of y.
    """

    factor: float
    explained: float

    @property
    def clear(self) -> bool:
        """Whether the relation can be relied on."""
        return self.explained > CLEAR


def moves(values: Array) -> bool:
    """Whether a column has more than one value, of usable size."""
    finite = values[np.isfinite(values)]
    return len(finite) > 2 and bool(0 < np.ptp(finite) < 1e30)


def slope(y: Array, x: Array, beside: Array | None = None) -> Slope | None:
    """Least squares of y over x, and a further column beside it; without the samples that stand out most.

    Returns:
        None where either does not move.
    """
    sound = np.isfinite(x) & np.isfinite(y) & (np.abs(x) < 1e30) & (np.abs(y) < 1e30)
    columns = [x, np.ones(len(x))]
    if beside is not None and moves(beside):
        sound &= np.isfinite(beside)
        columns.append(beside)
    if sound.sum() < 10 or not moves(x[sound]) or not moves(y[sound]):
        return None
    matrix = np.column_stack(columns)
    fit = np.zeros(len(columns))
    for _ in range(2):
        scale = np.maximum(np.abs(matrix[sound]).max(axis=0), 1e-300)
        fit = np.linalg.lstsq(matrix[sound] / scale, y[sound], rcond=None)[0] / scale
        rest = np.abs(y - matrix @ fit)
        # Spikes of a converter or a control loop, a thousandth of the samples, are left out the second time.
        sound &= rest <= np.quantile(rest[sound], 1.0 - _TRIMMED)
    rest = y[sound] - matrix[sound] @ fit
    spread = float(np.var(y[sound]))
    return Slope(float(fit[0]), 1.0 - float(np.var(rest)) / spread if spread else 0.0)


def integral(velocity: Array, time: Array) -> Array:
    """Running integral by the trapezoidal rule, in recorded units times s; missing samples count as 0."""
    sound = np.nan_to_num(velocity)
    steps = 0.5 * (sound[1:] + sound[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])


def turn_of(values: Array) -> float | None:
    """Size of the jumps of an angle that starts anew each turn, in recorded units; None where it does not.

    All its jumps of more than half its range are about as large as the range, and rare.
    """
    finite = values[np.isfinite(values)]
    if len(finite) < 10:
        return None
    whole = float(np.ptp(finite))
    steps = np.abs(np.diff(finite))
    far = steps > 0.5 * whole
    if whole == 0 or not far.any() or far.mean() > 0.1 or (~far).sum() < 5:
        return None
    usual = float(np.max(steps[~far]))
    if usual > 0.2 * whole or float(np.min(steps[far])) < 0.8 * whole:
        return None
    # A jump is the turn less the step that the angle makes meanwhile.
    return float(np.median(steps[far])) + float(np.median(steps[~far]))


def unwound(values: Array, turn: float) -> Array:
    """Join the turns of an angle."""
    found = values.copy()
    sound = np.isfinite(found)
    found[sound] = np.unwrap(found[sound], period=turn)
    return found


def step_of(values: Array) -> float | None:
    """The smallest step of which all differences are whole multiples, or None."""
    finite = np.unique(values[np.isfinite(values)])[:5000]
    if len(finite) < 20:
        return None
    gaps = np.diff(finite)
    step = float(gaps.min())
    if step <= 0:
        return None
    many = gaps / step
    return step if np.all(np.abs(many - np.round(many)) < 1e-3) else None
