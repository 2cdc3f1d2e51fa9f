"""Modes of a linear model: frequency, damping, and the state that takes part most."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import control


@dataclass(frozen=True)
class Mode:
    """A real pole, or a pair of complex ones.

    Args:
        pole: 1/s; of a pair the one with positive imaginary part.
        frequency_hz: undamped natural frequency |pole| / 2 pi.
        damping_ratio: -Re(pole) / |pole|; NaN for a pole at zero.
        state: name of the state that takes part most.
        participation: its share, 0 to 1.
    """

    pole: complex
    frequency_hz: float
    damping_ratio: float
    state: str
    participation: float

    @property
    def oscillates(self) -> bool:
        """Whether it is a pair of complex poles."""
        return self.pole.imag > 0.0


def modes(system: control.StateSpace) -> list[Mode]:
    """Modes of a state-space model, slowest first.

    A state's share in a mode is its participation factor |w_k v_k| with right and left eigenvectors v and w
    (Perez-Arriaga, Verghese and Schweppe 1982, IEEE Trans. Power Apparatus and Systems 101:3117), which does
    not depend on the states' units, normalised over the states.
    """
    from scipy.linalg import eig, matrix_balance

    matrix: Any = np.asarray(system.A, dtype=float)
    if len(matrix) == 0:
        return []
    matrix, _ = matrix_balance(matrix, permute=False)
    poles, left, right = eig(matrix, left=True, right=True)
    taking_part = np.abs(left.conj() * right)
    # Rounding moves the poles of a rigid body, and of whatever else only integrates, away from zero, by
    # eps |A| / |w v| to first order, which is much for the double pole of a free shaft.
    condition = np.maximum(np.abs(np.sum(left.conj() * right, axis=0)), np.finfo(float).tiny)
    rounding = 10.0 * np.finfo(float).eps * float(np.linalg.norm(matrix)) / condition
    poles[np.abs(poles) < rounding] = 0.0
    found = []
    for k, pole in enumerate(poles):
        if pole.imag < 0.0:
            continue
        size = abs(pole)
        most = int(np.argmax(taking_part[:, k]))
        found.append(
            Mode(
                complex(pole),
                float(size / (2.0 * np.pi)),
                float(-pole.real / size) if size > 0.0 else float("nan"),
                str(system.state_labels[most]),
                float(taking_part[most, k] / np.sum(taking_part[:, k])),
            )
        )
    return sorted(found, key=lambda mode: mode.frequency_hz)
