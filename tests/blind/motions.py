"""Motions that the plants are asked to follow: angle and speed at the output over time.

All start and end smoothly enough for the controller, and all turn in both directions. What varies with the
seed are amplitudes, frequencies, pauses and order.
"""

from __future__ import annotations

import numpy as np
from drives import Drive

#: Rate of the controller and of the plant's own clock, Hz; a log's rate divides it.
CONTROL_RATE = 10000

KINDS = ("swing", "moves", "chirp", "constant", "multisine", "locked")


def reference(
    kind: str, drive: Drive, seconds: float, seed: list[int], share: float = 1.0, softest: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Angle and speed at the output, shape (n,) each; of the twist where the output is locked.

    Args:
        kind: of motion.
        drive: its top speed and torques size the motion.
        seconds: length.
        seed: of what varies.
        share: factor on the twist where the output is locked.
        softest: speeds are a moving mean over at least this, s.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * CONTROL_RATE)) / CONTROL_RATE
    top = drive.top_speed / abs(drive.ratio)
    speed = {
        "swing": _swing, "moves": _moves, "chirp": _chirp, "constant": _constant, "multisine": _multisine,
        "locked": _locked,
    }[kind](t, top, rng)  # fmt: skip
    if kind == "locked":
        speed *= _locked_twist(drive) * rng.uniform(0.9, 1.1) * share
    if softest > 0:
        speed = _rounded(_rounded(speed, softest), softest)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / CONTROL_RATE
    return angle, speed


def _swing(t: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """A slow and a faster swing on top of one another."""
    slow, fast = 0.11 * rng.uniform(0.8, 1.2), 0.53 * rng.uniform(0.8, 1.2)
    share = rng.uniform(0.5, 0.7)
    fade = 1.0 - np.exp(-t / 0.3)
    return fade * top * (share * np.cos(2 * np.pi * slow * t) + (1 - share) * np.sin(2 * np.pi * fast * t))


def _moves(t: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """Point-to-point moves with trapezoidal speed and pauses, back and forth."""
    speed, now, direction, place = np.zeros_like(t), 0.15, 1.0, 0.0
    while now < t[-1]:
        cruise, ramp, run = top * rng.uniform(0.3, 1.0), rng.uniform(0.15, 0.4), rng.uniform(0.3, 1.3)
        s = t - now
        speed += direction * cruise * np.clip(np.minimum(s, 2 * ramp + run - s) / ramp, 0.0, 1.0)
        place += direction * cruise * (ramp + run)
        now += 2 * ramp + run + rng.uniform(0.1, 0.5)
        direction = -np.sign(place) if abs(place) > 1.0 * top or rng.random() < 0.7 else direction
    return _rounded(speed, 0.05)


def _chirp(t: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """A sweep from slow to brisk swings, up and down again; the speed falls as the frequency rises."""
    low, high, end = 0.12 * rng.uniform(0.8, 1.2), rng.uniform(2.0, 4.0), t[-1]
    rate = 2.0 * np.log(high / low) / end
    up = np.minimum(t, end - t)
    frequency = low * np.exp(rate * up)
    phase = 2 * np.pi * np.concatenate([[0.0], np.cumsum(frequency[:-1])]) / CONTROL_RATE
    return top * (frequency / low) ** -0.35 * np.sin(phase)


def _constant(t: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """Constant speeds, each in both directions, from slow to fast."""
    levels = top * rng.permutation([0.04, 0.15, 0.45, 0.8, 1.0])
    pieces = np.repeat(levels, 2) * np.tile([1.0, -1.0], len(levels))
    length = t[-1] / len(pieces)
    which = np.minimum((t / length).astype(int), len(pieces) - 1)
    # It starts from rest: what a drive did before its log begins, nobody knows.
    speed = np.where(t < 0.2, 0.0, pieces[which])
    for _ in range(3):
        speed = _rounded(speed, 0.08)
    return speed


def _multisine(t: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """Six sines from 0.05 to 2 Hz with random phases, the slow ones larger; begins from rest."""
    speed = np.zeros_like(t)
    for frequency in 0.05 * 40.0 ** rng.uniform(0.0, 1.0, 6):
        speed += frequency**-0.3 * np.sin(2 * np.pi * frequency * t + rng.uniform(0.0, 2 * np.pi))
    return (1.0 - np.exp(-t / 0.3)) * top * rng.uniform(0.7, 1.0) * speed / np.abs(speed).max()


def _locked(t: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """Ramps of the twist against a locked output: full cycles and smaller ones inside; unit amplitude."""
    del top
    turns, sign = [0.0], 1.0
    while sum(np.abs(np.diff(turns))) < 40:
        turns.append(sign * rng.choice([1.0, 1.0, 0.6, 0.35]))
        sign = -sign
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)))])
    pace = rng.uniform(1.2, 1.8)  # full amplitudes a second
    ramp = np.interp(pace * np.minimum(t, 1e9), travel, turns)
    return np.gradient(_rounded(ramp, 0.08), 1.0 / CONTROL_RATE)


def _locked_twist(drive: Drive) -> float:
    """Twist well into the third segment of the spring, rad at the output."""
    (k1, k2, k3), (t1, t2) = drive.stiffness, drive.torques
    return t1 / k1 + (t2 - t1) / k2 + 0.4 * t2 / k3


def _rounded(values: np.ndarray, seconds: float) -> np.ndarray:
    """A moving mean over ``seconds``, so that neither the controller nor the log meets a jump."""
    width = max(round(seconds * CONTROL_RATE), 1)
    padded = np.pad(values, (width, width), mode="edge")
    return np.convolve(padded, np.ones(width) / width, mode="same")[width:-width]
