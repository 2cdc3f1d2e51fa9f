"""Torques that are read late beside the motion, told by the order that they blur."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.numbers import delay_freedoms
from hdsim.estimate.orders import LEAST_LINE, over_angle
from hdsim.estimate.records import Array

#: Ages of a channel's readings that are tried, in samples (three spreads of what is believed of a delay), and
#: factor by which an age must make the strongest line stronger (estimate: half of it is then lost without).
OLDEST, AGE_STEP = 3.0, 0.25
STRONGER = 2.0


def read_late(bench: Bench, current: Fit) -> Fit:
    """A fit whose torques are as late beside the motion as lines in their order spectra tell."""
    if any(each.step for each in current.frees):
        return current  # ages are fitted already
    before, residuals = current.state, bench.residuals(current.predictions, drift=True)
    torques = [
        free.delay_of for free in delay_freedoms(before, bench.channels, 0.0, load_known=bench.load_known)
    ]
    ages = {c: age_by_lines(bench, residuals, c) for c in torques if c not in before.delays}
    delays = {channel: age for channel, age in ages.items() if age != 0.0}
    if not delays:
        return current
    state = replace(before, delays={**before.delays, **delays})
    return replace(current, state=state, predictions=bench.reread(current.predictions, before, state))


def age_by_lines(bench: Bench, residuals: Sequence[Array], channel: str) -> float:
    """Age of a channel's readings beside the motion at which an order stands out of it, s.

    A channel that is read late shows an order blurred wherever the speed varies, and its lines are too weak
    to be located. 0 where no age makes the strongest line much stronger.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        channel: its name.
    """
    over = over_angle(bench, residuals, channel)
    if over is None or over.highest < 1.0:
        return 0.0
    orders = np.arange(1.0, int(over.highest) + 1)
    ages = over.period_s * np.arange(-OLDEST, OLDEST + AGE_STEP / 2, AGE_STEP)
    waves = over.value * np.exp(-1j * np.outer(orders, over.angle - ages[0] * over.velocity))
    older = np.exp(1j * np.outer(orders, (ages[1] - ages[0]) * over.velocity))
    shares = np.zeros((len(ages), len(orders)))
    for k in range(len(ages)):
        shares[k] = 2.0 * np.abs(waves.mean(axis=1)) ** 2 / np.mean(over.value**2)
        waves *= older
    strongest = shares.max(axis=1)
    best, now = int(np.argmax(strongest)), int(np.argmin(np.abs(ages)))
    return float(ages[best]) if strongest[best] > max(LEAST_LINE, STRONGER * strongest[now]) else 0.0
