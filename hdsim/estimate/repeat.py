"""How much of what a model leaves repeats itself from one turn of the wave generator to the next.

An error of teeth, magnets or scales has after a turn the phase that it had before, and what is a function of
load, speed or the output's angle has changed little: it repeats. Noise, vibration and what happens once do
not. With r the residual over the motor's angle theta, the share of its power that repeats is its
autocorrelation at a lag of one turn, sum r(theta) r(theta - 2 pi) / sum r^2: of a repeating part and one that
is independent of itself a turn before, the power of the first over that of both (the synchronous average of
rotating machines rests on the same: Braun 1975, Acustica 32:69). What does not repeat no law of angle, speed
and load can explain, but for one that changes within a turn, as at a reversal, or that counts half turns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.found import Gap
from hdsim.estimate.orders import angle_read
from hdsim.estimate.prove import DRAWS
from hdsim.estimate.records import FEWEST_SAMPLES, Array
from hdsim.estimate.state import State

TURN = 2.0 * np.pi
#: Fewest blocks of time with samples a turn after others, for an interval.
FEWEST_BLOCKS = 5


def with_repeats(
    bench: Bench, state: State, gap: Mapping[str, Gap], predictions: Sequence[Array]
) -> dict[str, Gap]:
    """The gaps with the share of what the final model leaves that repeats from turn to turn.

    Args:
        bench: the measured series.
        state: the final model, for how late its channels are read.
        gap: by channel.
        predictions: of all series by this model.
    """
    residuals = bench.residuals(predictions, drift=True)
    found = {}
    for channel, own in gap.items():
        share = repeating(bench, channel, residuals, state.delays.get(channel, 0.0))
        changes = {} if share is None else {"repeats": share[0]}
        intervals = own.intervals | ({} if share is None else {"repeats": share[1]})
        found[channel] = own.model_copy(update={**changes, "intervals": intervals})
    return found


def repeating(
    bench: Bench, channel: str, residuals: Sequence[Array], age_s: float = 0.0
) -> tuple[float, tuple[float, float]] | None:
    """Share of a residual's power that repeats after a turn of the wave generator, with its 95 % interval.

    Held-out samples count too: nothing is fitted.

    Args:
        bench: the measured series.
        channel: its name.
        residuals: of every series, SI units.
        age_s: how late the channel is read beside the motion.

    Returns:
        None where too few samples are a turn after others.
    """
    from scipy.interpolate import CubicSpline

    products, powers, count = np.zeros(bench.blocks), np.zeros(bench.blocks), 0
    for series, rest in zip(bench.series, residuals, strict=True):
        predictor = bench.predictors[series.record]
        if series.channel != channel or not len(rest) or predictor.plan.locked:
            continue
        time, angle, good = predictor.record.time, angle_read(predictor, age_s), series.train | series.hold
        # A straight line between samples would lose a seventh of an order with six of them in a period.
        course = CubicSpline(time, rest)
        for run in np.split(np.arange(len(angle)), np.flatnonzero(np.diff(np.sign(np.diff(angle)))) + 1):
            gone = np.abs(angle[run] - angle[run[0]])
            moment = np.interp(gone - TURN, gone, time[run])
            # The earlier reading lies between two samples that count.
            later = good[run] & (gone >= TURN) & (np.interp(moment, time, good) == 1.0)
            own, moment, block = rest[run][later], moment[later], series.block[run][later]
            power = 0.5 * (own**2 + np.interp(moment, time, rest**2))
            products += np.bincount(block, own * course(moment), bench.blocks)
            powers += np.bincount(block, power, bench.blocks)
            count += len(own)
    used = np.flatnonzero(powers)
    if count < FEWEST_SAMPLES or len(used) < FEWEST_BLOCKS:
        return None
    picks = np.random.default_rng(23).choice(used, size=(DRAWS, len(used)))
    draws = products[picks].sum(axis=1) / powers[picks].sum(axis=1)
    low, high = np.quantile(draws, [0.025, 0.975])
    share = float(products.sum() / powers.sum())
    return max(share, 0.0), (max(float(low), 0.0), max(float(high), 0.0))
