"""Zeros of the sensors: of a torque one for all records, of an angle one for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from hdsim.estimate.records import Array
from hdsim.estimate.series import Series

#: Whether a torque sensor has one zero in all records, was zeroed before each, or is trusted to have none.
Zeros = Literal["campaign", "record", "trusted"]
ZEROS: tuple[Zeros, Zeros] = ("campaign", "record")
#: Standard deviations of a channel's noise by which its zero may move from one record to the next (estimate:
#: what nobody would see in a record need not be explained).
DRIFT = 2.0


def groups(series: Sequence[Series], zeros: Zeros) -> list[list[int]]:
    """Series that share a zero, as their numbers.

    A torque sensor, or a current, has one zero in a campaign: what differs between records at constant speed
    is friction. Angles count from where each record began to count. A torque that is trusted has no zero, and
    motion one way tells its Coulomb friction then.
    """
    found: dict[tuple[str, int], list[int]] = {}
    for k, one in enumerate(series):
        if zeros == "trusted" and one.channel.endswith("torque"):
            continue
        own = one.record if zeros == "record" or one.channel.endswith("angle") else -1
        found.setdefault((one.channel, own), []).append(k)
    return list(found.values())


def offsets_of(
    series: Sequence[Series], values: Sequence[Array], zeros: Zeros, *, drift: bool
) -> list[float]:
    """The zero of every series, of what is measured less predicted or of a change of it.

    The least-squares constant of its group over the samples that a fit may see. A record's own mean lies that
    far from it as well, up to what a sensor's zero may drift.

    Args:
        series: all of them.
        values: shape (n,) each, or (0,) where nothing was predicted.
        zeros: which of them share one.
        drift: whether zeros may drift; not in a derivative.
    """
    found = [0.0] * len(series)
    for group in groups(series, zeros):
        there = [k for k in group if len(values[k])]
        means: dict[int, float] = {}
        common = weights = 0.0
        for k in there:
            one = series[k]
            seen = one.train if one.train.any() else one.hold
            means[k] = float(values[k][seen].mean()) if seen.any() else 0.0
            weight = float(one.train.sum()) / one.sigma**2
            common, weights = common + weight * means[k], weights + weight
        for k, mean in means.items():
            if weights == 0.0 or len(means) == 1 or series[k].own_zero:
                found[k] = mean  # nobody shares it, or only the proof sees this channel
                continue
            zero = common / weights
            bound = DRIFT * series[k].reading if drift else 0.0
            found[k] = zero + float(np.clip(mean - zero, -bound, bound))
    return found


def part_zeros(
    series: Sequence[Series], values: Sequence[Array], zeros: Zeros, speeds: Sequence[Array]
) -> None:
    """Let zeros of a channel differ in fits where what they do is no more than they drift, and tells nothing.

    Records that each pass through more speeds than lie between them (analysis of variance) tell friction,
    weight and inertia by themselves. What their means differ by is the sensor's, as long as nobody would see
    it in a record; of means of many readings a fit would make numbers of it. At constant speeds it is
    friction.

    Args:
        series: all of them; ``own_zero`` is set.
        values: what is measured less predicted, shape (n,) each, or (0,) where nothing was predicted.
        zeros: which of them share one.
        speeds: the motor's velocity in each training record, (n,).
    """
    within = float(np.mean([np.var(speed) for speed in speeds]))
    swings = within > float(np.var([np.mean(speed) for speed in speeds]))
    for group in groups(series, zeros):
        seen = [k for k in group if series[k].record < len(speeds) and series[k].train.any()]
        means = [float(values[k][series[k].train].mean()) for k in seen]
        weights = [float(series[k].train.sum()) / series[k].noise ** 2 for k in seen if series[k].noise > 0.0]
        alike = len(seen) > 1 and len(weights) == len(seen)
        if alike:
            zero = float(np.average(means, weights=weights))
            alike = all(abs(m - zero) < DRIFT * series[k].reading for k, m in zip(seen, means, strict=True))
        for k in seen:
            series[k].own_zero = swings and alike


def offset_columns(series: Sequence[Series], training: int, zeros: Zeros) -> Array:
    """What a shift of each zero does to the whitened training samples, shape (rows, zeros), its largest as 1.

    Args:
        series: all of them.
        training: number of the records that fits see.
        zeros: which of them share one.
    """
    seen = [k for k, one in enumerate(series) if one.record < training]
    sizes = {k: int(series[k].train.sum()) for k in seen}
    columns = []
    shared = [[k for k in group if not series[k].own_zero] for group in groups(series, zeros)]
    for group in [*shared, *([k] for k in seen if series[k].own_zero)]:
        if not any(sizes.get(k) for k in group):
            continue
        least = min(series[k].sigma for k in group if k in sizes)
        columns.append(
            np.concatenate([np.full(sizes[k], least / series[k].sigma if k in group else 0.0) for k in seen])
        )
    return np.column_stack(columns) if columns else np.zeros((sum(sizes.values()), 0))


def drift_columns(series: Sequence[Series], training: int, zeros: Zeros) -> tuple[Array, Array]:
    """What a record's zero beside the common one of its channel does to the whitened training samples.

    Args:
        series: all of them.
        training: number of the records that fits see.
        zeros: which of them share one.

    Returns:
        Shape (rows, drifts), the common zero taken out, and what is believed of them before, (drifts,), SI
        units: anything up to ``DRIFT`` of a single reading's noise is as likely.
    """
    seen = [k for k, one in enumerate(series) if one.record < training]
    first = dict(zip(seen, np.cumsum([0, *(int(series[k].train.sum()) for k in seen)]), strict=False))
    rows = sum(int(series[k].train.sum()) for k in seen)
    columns, spreads = [], []
    for group in groups(series, zeros):
        own = [k for k in group if k in first and series[k].train.any() and series[k].reading > 0.0]
        own = [k for k in own if not series[k].own_zero]
        weights = np.array([series[k].train.sum() / series[k].sigma ** 2 for k in own])
        for k, part in zip(own, weights / weights.sum(), strict=True) if len(own) > 1 else ():
            column = np.zeros(rows)
            for j in own:
                count = int(series[j].train.sum())
                column[first[j] : first[j] + count] = (float(j == k) - part) / series[j].sigma
            columns.append(column)
            spreads.append(DRIFT * series[k].reading / np.sqrt(3.0))
    return np.column_stack(columns) if columns else np.zeros((rows, 0)), np.array(spreads)
