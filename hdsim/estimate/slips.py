"""Samples that a log has repeated or lost, where an angle and its measured velocity contradict each other.

From one sample to the next an angle goes on by the integral of its velocity. Where a log repeats a sample it
goes on by nothing, where one is lost by twice as much: the difference is the way of a whole sample, for one
sample, and a spike beside its neighbours (Hampel's identifier, ``hdsim.estimate.spikes``). A controller that
was given the same reading jerks, too. How the joint moved then is in neither reading, and what a model
foretells from the motion cannot be compared there.
"""

from __future__ import annotations

import numpy as np

from hdsim.estimate.noise import quantisation_step
from hdsim.estimate.records import Array, Mask
from hdsim.estimate.spikes import find_spikes

#: Least part of a sample's way by which the angle must be off: between none and all of it.
HALF = 0.5
#: Steps of the angle's sensor that the difference must exceed.
STEPS = 3.0
#: Samples before a slip that a spline smears it over, and after it until a controller that was jerked by it
#: has settled (estimate: 15 of its samples are two periods of a loop with a twentieth of their rate or more).
BEFORE, AFTER = 5, 15
#: Largest part of a record that is left out for slips: with more of them they are how it was sampled.
MOST = 0.25


def find_slips(time: Array, angle: Array, velocity: Array, trusted: Mask) -> Mask:
    """Samples by which an angle has gone on by none or by twice of what its velocity says: shape (n,).

    Args:
        time: shape (n,), s.
        angle: shape (n,), rad.
        velocity: shape (n,), rad/s.
        trusted: shape (n,), samples of both that count.
    """
    way = np.zeros(len(time))
    way[1:] = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    apart = np.diff(angle, prepend=angle[0]) - way
    large = (np.abs(apart) > HALF * np.abs(way)) & (np.abs(apart) > STEPS * quantisation_step(angle[trusted]))
    if not np.any(large) or np.ptp(apart[trusted]) == 0.0:
        return np.zeros(len(time), dtype=bool)
    return np.asarray(find_spikes(apart, trusted) & large)


def around(slips: Mask) -> Mask:
    """Samples near slips, of which nobody knows the motion: shape (n,)."""
    near = np.convolve(slips, np.ones(BEFORE + AFTER + 1))[BEFORE : BEFORE + len(slips)]
    return np.asarray(near > 0.5)
