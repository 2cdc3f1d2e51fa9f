"""Torques that are read late beside the motion, told by the order that they blur."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.numbers import delay_freedoms
from hdsim.estimate.orders import LEAST_LINE, Line, OverAngle, means_over, order_lines, over_angle
from hdsim.estimate.records import Array

#: Ages of a channel's readings that are tried, in samples (three spreads of what is believed of a delay), and
#: factor by which an age must make the strongest line stronger (estimate: half of it is then lost without).
OLDEST, AGE_STEP = 3.0, 0.25
STRONGER = 2.0
#: The same beside a line that turns with the direction: each of the two takes most of the other, and the true
#: one is only a little better (estimate).
CLEARER = 1.05


def read_late(bench: Bench, current: Fit) -> Fit:
    """A fit whose torques are as late beside the motion as lines in their order spectra tell.

    The age must leave less of the channel as a whole: what the model predicts is read later, too.
    """
    if any(each.step for each in current.frees):
        return current  # ages are fitted already
    before = current.state
    for free in delay_freedoms(before, bench.channels, 0.0, load_known=bench.load_known):
        channel = free.delay_of
        if channel in before.delays:
            continue
        age, left = age_by_lines(bench, bench.residuals(current.predictions, drift=True), channel)
        if age == 0.0:
            continue
        state = replace(current.state, delays={**current.state.delays, channel: age})
        predictions = bench.reread(current.predictions, current.state, state)
        over = over_angle(bench, bench.residuals(predictions, drift=True), channel)
        if over is not None and _left(over, _strongest(over, age)) < left:
            current = replace(current, state=state, predictions=predictions)
    return current


def age_by_lines(bench: Bench, residuals: Sequence[Array], channel: str) -> tuple[float, float]:
    """Age of a channel's readings beside the motion at which an order stands out of it, s.

    A channel that is read late shows an order blurred wherever the speed varies, and its lines are too weak
    to be located. 0 where no age makes the strongest line much stronger, or where one that turns its sign
    with the direction, as friction does, is as strong.

    Args:
        bench: the measured series.
        residuals: of every series, SI units.
        channel: its name.

    Returns:
        The age, and the mean square that the strongest line without an age leaves.
    """
    over = over_angle(bench, residuals, channel)
    if over is None or over.highest < 1.0:
        return 0.0, 0.0
    ages = over.period_s * np.arange(-OLDEST, OLDEST + AGE_STEP / 2, AGE_STEP)
    strongest = np.array([_strongest(over, age) for age in ages])
    turning = replace(over, value=over.value * np.sign(over.velocity))
    now, turned = _strongest(over, 0.0), _strongest(turning, 0.0)
    best = int(np.argmax(strongest))
    stands_out = strongest[best] > max(LEAST_LINE, STRONGER * now, CLEARER * turned)
    return (float(ages[best]) if stands_out else 0.0), _left(over, max(now, turned))


def lines_shown(bench: Bench, before: Fit, late: Fit) -> list[Line]:
    """Lines that stand out where the torques are read as late as a fit says, and did not before it.

    Args:
        bench: the measured series.
        before: the fit with the ages as they were.
        late: the one with those that were fitted.
    """
    found: list[Line] = []
    for channel, age_s in late.state.delays.items():
        earlier, now = (
            order_lines(bench, bench.residuals(each.predictions, drift=True), channel, age_s=age)
            for each, age in ((before, before.state.delays.get(channel, 0.0)), (late, age_s))
        )
        known = [line.order for line in earlier]
        found += [line for line in now if all(abs(line.order - order) > 0.5 / bench.turns for order in known)]
    return found


def _strongest(over: OverAngle, age: float) -> float:
    """Largest share of a channel's power at a whole order that can be seen, where it is read so late."""
    orders = np.arange(max(1.0, np.ceil(over.lowest)), int(over.highest) + 1)
    angle = over.angle - age * over.velocity
    shares = 2.0 * np.abs(means_over(angle, over.value, orders)) ** 2
    return float(shares.max() / np.mean(over.value**2))


def _left(over: OverAngle, share: float) -> float:
    """Mean square that a line of this share leaves."""
    return float(np.mean(over.value**2)) * (1.0 - share)
