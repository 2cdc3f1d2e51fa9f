"""Which numbers the data determine, and from which others those that they don't cannot be told."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.estimate.covariance import sample_power
from hdsim.estimate.records import Array

#: Ratio of posterior to prior spread above which the data are said not to determine a number.
UNDETERMINED = 0.5
#: Least share in the weakest direction that makes a number a tie, and least size of a number's own effect, in
#: standard deviations of the data at its prior spread, for it to be tied rather than unseen.
SHARE, SEEN = 0.3, 2.0
#: Part by which spreads that are the same may differ.
EVEN = 1e-6


@dataclass(frozen=True)
class Determined:
    """Numbers by their index: what is left to fit, what stays, and what ties that to the others.

    Attributes:
        kept: rising.
        dropped: in the order in which they went.
        ties: of each dropped number.
        power: what one independent sample of the residual counts once a step of the fit is taken.
    """

    kept: list[int]
    dropped: list[int]
    ties: dict[int, list[int]]
    power: float


def determined(
    columns: Array,
    rest: Array,
    priors: Array,
    blocks: NDArray[np.int64],
    candidates: int,
    named: int | None = None,
) -> Determined:
    """Split numbers into those that the data determine and the others.

    The scaled Jacobian's singular values say how many directions the data see; the number with the largest
    share in an unseen one is dropped, one after the other.

    Args:
        columns: sensitivities where the fit begins, shape (rows, p).
        rest: the residual there, shape (rows,).
        priors: prior standard deviations, shape (p,), finite.
        blocks: shape (rows,).
        candidates: that many of the first numbers may be dropped.
        named: that many of the first may be what a dropped one is tied to; the candidates by default.
    """
    # What one step of the fit takes away is no noise, however far off the start is.
    step, *_ = np.linalg.lstsq(columns * priors, rest, rcond=1e-6)
    rest = rest - columns * priors @ step
    power = sample_power(rest, blocks)
    kept = list(range(candidates))
    others = list(range(candidates, columns.shape[1]))
    dropped: list[int] = []
    ties: dict[int, list[int]] = {}
    while kept:
        use = kept + others
        scaled = columns[:, use] * priors[use] / math.sqrt(power)
        _, singular, directions = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
        spread = (directions**2 / (1.0 + singular[:, None] ** 2)).sum(axis=0)[: len(kept)]
        # Two that do the same are told apart by rounding alone: the later one goes, on any processor.
        worst = int(np.flatnonzero(spread >= (1.0 - EVEN) * spread.max())[-1])
        if math.sqrt(spread[worst]) <= UNDETERMINED:
            break
        weakest = directions[-1]
        tied = np.linalg.norm(scaled[:, worst]) > SEEN
        last = candidates if named is None else named
        ties[kept[worst]] = [
            use[k]
            for k in range(len(use))
            if k != worst and use[k] < last and tied and abs(weakest[k]) > SHARE
        ]
        dropped.append(kept.pop(worst))
    return Determined(kept, dropped, ties, power)
