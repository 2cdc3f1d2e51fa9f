"""How visible a hidden effect is, and plants sized to a wanted visibility.

The trace of an effect is the change that it makes to what ideal sensors read while the motor moves in the
same way: the plant with the effect follows its controller, the plant without it follows that motor's
motion. Its plain strength is the largest root-mean-square of a channel's trace over that channel's noise.
Much of a trace can look like a wrong number of the base model (a compliance like a softer drive, friction
on the load like more friction on the motor), and no tool can or should tell that from the wrong number. So
the strength that counts is taken after least squares have removed an offset of each channel and the plant's
sensitivities to its own inertias, stiffness, damping, friction, weight and torque constant, all channels
together, weighed by their noise. It is that of the first `WINDOW_S` of the first record.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from motions import CONTROL_RATE
from plant_numbers import Numbers
from sensing import Setup, numbers, readings, sampled, truth

#: What of a record is looked at, s.
WINDOW_S = 12.0
#: Every twentieth reading of the controller's clock enters; the first tenth of a second doesn't.
EVERY = 20
SKIP = CONTROL_RATE // 10
#: The base model's own numbers; those that scale together are one.
OWN = (
    ("motor_inertia",), ("load_inertia",), ("k1", "k2", "k3"), ("damping",), ("coulomb",), ("viscous",),
    ("load_loss",), ("arm",), ("gain",),
)  # fmt: skip
CHANGE = 0.02


@dataclass(frozen=True)
class Strength:
    """Root-mean-square trace over noise in the channel where it is largest."""

    plain: float
    beyond_base: float
    channel: str


def weighed(setup: Setup, p: Numbers, log: np.ndarray) -> np.ndarray:
    """Readings of the compared channels over their noise, shape (channels, n)."""
    found, noises = readings(p, log), setup.noises()
    return np.array([found[c][SKIP::EVERY] / noises[c] for c in setup.compared()])


@lru_cache(maxsize=2)
def _explained(setup: Setup) -> np.ndarray:
    """An orthonormal basis of what offsets and the base's numbers can explain, shape (channels * n, k)."""
    base = numbers(setup, {})
    log = truth(setup, base, seconds=WINDOW_S)
    plain = weighed(setup, base, log)
    columns = []
    for names in OWN:
        if getattr(base, names[0]) == 0 or (setup.locked and names[0] in ("load_inertia", "arm")):
            continue
        varied = numbers(setup, {name: getattr(base, name) * (1.0 + CHANGE) for name in names})
        columns.append(((weighed(setup, varied, truth(setup, varied, log)) - plain) / CHANGE).ravel())
    columns += [row.ravel() for row in np.eye(len(plain))[:, :, None] * np.ones(plain.shape)]
    matrix = np.array(columns).T
    matrix /= np.linalg.norm(matrix, axis=0) + 1e-300
    basis, values, _ = np.linalg.svd(matrix, full_matrices=False)
    return basis[:, values > 1e-8 * values[0]]


def _trace(setup: Setup, changes: dict[str, float]) -> np.ndarray:
    """Trace of changes over the noise, less its mean, shape (channels, n)."""
    p, base = numbers(setup, changes), numbers(setup, {})
    log = truth(setup, p, seconds=WINDOW_S)
    trace = weighed(setup, p, log) - weighed(setup, base, truth(setup, base, log))
    return trace - trace.mean(axis=1, keepdims=True)


def plain_strength(setup: Setup, changes: dict[str, float]) -> Strength:
    """Strength of numbers of the base that are off: nothing is left beyond the base."""
    size = np.sqrt(np.mean(_trace(setup, changes) ** 2, axis=1))
    best = int(np.argmax(size))
    return Strength(float(size[best]), 0.0, setup.compared()[best])


def strength(setup: Setup, changes: dict[str, float]) -> Strength:
    """Strength of the trace that ``changes`` leave."""
    centred = _trace(setup, changes)
    basis, flat = _explained(setup), centred.ravel()
    rest = (flat - basis @ (basis.T @ flat)).reshape(centred.shape)
    beyond = np.sqrt(np.mean(rest**2, axis=1))
    best = int(np.argmax(beyond))
    return Strength(
        float(np.sqrt(np.mean(centred**2, axis=1)).max()), float(beyond[best]), setup.compared()[best]
    )


def unresolved(setup: Setup, changes: dict[str, float]) -> float:
    """How much of a record its samples cannot carry: the largest root-mean-square over the noise.

    The same plant is moved as a cubic through the samples of the motor's angle says (without noise). Where
    that reads otherwise than the plant itself, the log is too slow for the motion, and no model could
    explain it. The ends, where a cubic has nothing to hold on to, are left out.
    """
    p = numbers(setup, changes)
    log = truth(setup, p, seconds=WINDOW_S)
    like = sampled(setup, log)
    rest = weighed(setup, p, log[: len(like)]) - weighed(setup, p, truth(setup, p, like))
    rest = rest[:, : -2 * SKIP // EVERY]
    return float(np.sqrt(np.mean((rest - rest.mean(axis=1, keepdims=True)) ** 2, axis=1)).max())
