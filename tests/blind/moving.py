"""Motions that the families' plants are asked to follow: angle and speed of the output over time."""

from __future__ import annotations

import numpy as np

MOTIONS = ("multisine", "moves", "sweep", "plateaus", "creep")


def motion(
    kind: str, seconds: float, top: float, rng: np.random.Generator, *, tick_hz: int, smooth_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Angle and speed of the output at a controller's ticks, shape (n,) each; it starts at rest at angle 0.

    Args:
        kind: of ``MOTIONS``.
        seconds: length.
        top: speed that is not exceeded, rad/s at the output.
        rng: random numbers.
        tick_hz: rate of the ticks.
        smooth_s: three moving means of this width take the corners off.
    """
    t = np.arange(round(seconds * tick_hz)) / tick_hz
    pace = 0.1 / smooth_s  # slower where the smoothing is wide
    if kind == "multisine":
        lines = zip(np.exp(rng.uniform(np.log(0.06), np.log(1.0 * pace), 4)), rng.uniform(0, 2 * np.pi, 4),
                    rng.uniform(0.3, 1.0, 4), strict=True)  # fmt: skip
        speed = sum(size * np.sin(2 * np.pi * f * t + phase) for f, phase, size in lines)
    elif kind == "moves":
        speed, now, place = np.zeros_like(t), 0.1, 0.0
        while now < t[-1]:
            lasts, way = rng.uniform(0.5, 2.0) / pace, rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1.0)
            way = -np.sign(place) * abs(way) if abs(place) > 1.2 else way
            s = np.clip((t - now) / lasts, 0.0, 1.0)
            speed += way * 16 * (s * (1 - s)) ** 2  # the speed of a fifth-degree polynomial from rest to rest
            place += way * lasts * 0.53
            now += lasts + rng.uniform(0.0, 0.4)
    elif kind == "sweep":
        low, high = rng.uniform(0.1, 0.2), rng.uniform(1.2, 3.0) * pace
        share = np.abs(2 * t / max(t[-1], 1e-9) - 1)
        frequency = high * (low / high) ** share
        speed = (frequency / low) ** -0.4 * np.sin(2 * np.pi * np.cumsum(frequency) / tick_hz)
    elif kind == "plateaus":
        levels = np.repeat(rng.permutation([0.05, 0.2, 0.5, 0.75, 1.0]), 2) * np.tile([1.0, -1.0], 5)
        speed = levels[np.minimum((t * 10 / max(seconds, 1e-9)).astype(int), 9)]
        smooth_s = 2.5 * smooth_s  # between two speeds there is much to turn round
    else:
        turns = np.sin(2 * np.pi * t / rng.uniform(2.0, 5.0) + rng.uniform(0, 6.3))
        speed = rng.uniform(0.06, 0.25) * np.sign(turns) * rng.uniform(0.7, 1.0)
    peak = float(np.max(np.abs(speed)))
    if kind not in ("plateaus", "creep"):
        speed = speed / max(peak, 1e-9) * rng.uniform(0.6, 1.0)
    speed = top * speed * np.clip(t / max(3 * smooth_s, 0.2), 0.0, 1.0)
    # Late by what the moving means reach back, so that it starts from rest.
    width = max(round(smooth_s * tick_hz), 1)
    speed = np.concatenate([np.zeros(2 * width), speed])[: len(t)]
    for _ in range(3):
        padded = np.concatenate([np.zeros(width), speed, np.full(width, speed[-1])])
        speed = np.convolve(padded, np.ones(width) / width, mode="same")[width:-width]
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / tick_hz
    return angle, speed
