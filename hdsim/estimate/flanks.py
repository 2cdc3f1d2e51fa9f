"""What other flanks of the same roughness would do: nobody knows the ones that a drive has.

A mesh with teeth draws each tooth's half-gap and pitch error (``hdsim.surface``), and the drive that was
measured has drawn its own. So a prediction is known up to what another draw changes, and what is no larger
is no effect.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.parameters import ToothedMesh
from hdsim.estimate.bench import Bench
from hdsim.estimate.covariance import correlation
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import State
from hdsim.estimate.vector import Vector

if TYPE_CHECKING:
    from hdsim.estimate.fit import Fit

#: Other draws that are asked; the power that the largest change of them may be exceeded by. The drive's own
#: flanks are one more draw: beyond the largest of eight it is in one case of nine, beyond 1.5 times that
#: power seldom.
DRAWS, SPARE = 8, 1.5


def drawn_anew(state: State) -> list[State]:
    """The model with other flanks; none where nothing of its teeth is drawn."""
    mesh = state.drive.mesh
    if not isinstance(mesh, ToothedMesh):
        return []
    if mesh.pitch_error_m == 0.0 and (mesh.half_gap_m is not None or mesh.flanks.backlash == "single"):
        return []
    flanks = mesh.flanks.model_copy(update={"seed": None})
    drive = state.drive.model_copy(update={"mesh": mesh.model_copy(update={"flanks": flanks})})
    seeds = np.random.default_rng([state.seed, 31]).integers(2**31, size=DRAWS)
    return [replace(state, drive=drive, seed=int(seed)) for seed in seeds]


def hear_flanks(bench: Bench, state: State) -> None:
    """Add to every series' noise what other flanks do to its prediction, and keep those predictions.

    No more than what the model leaves of the channel: what is not there is no noise.

    Args:
        bench: the measured series.
        state: the model, at fitted numbers.
    """
    bench.redrawn = []
    others = drawn_anew(state)
    if not others:
        return
    with bench.coarse():
        try:
            bench.redrawn = [bench.predict(one, everything=True) for one in [state, *others]]
        except PredictionError:
            return
    own, *there = bench.redrawn
    left: dict[str, float] = {}
    for series, rest in zip(bench.series, bench.residuals(own), strict=True):
        if series.train.any():
            # The median: the stretches that something missing stirs up least.
            size = float(np.median(np.abs(rest[series.train]))) / 0.6745
            left[series.channel] = max(size, left.get(series.channel, 0.0))
    for k, series in enumerate(bench.series):
        rows = series.train | series.hold
        if not rows.any():
            continue
        heard = float(np.sqrt(np.mean([np.var((one[k] - own[k])[rows]) for one in there])))
        most = left.get(series.channel, np.inf) ** 2 - series.noise**2
        heard = min(heard, float(np.sqrt(max(most, 0.0))))
        series.noise, series.reading = (float(np.hypot(n, heard)) for n in (series.noise, series.reading))


def only_flanks(bench: Bench, power: float, project: Callable[[Array], Array]) -> bool:
    """Whether a whitened power is no more than what other flanks do; see ``of_other_flanks``."""
    return bool(bench.redrawn) and power < of_other_flanks(bench, project)


def of_other_flanks(bench: Bench, project: Callable[[Array], Array]) -> float:
    """Whitened power beyond which a change is more than other flanks do; 0 where none are drawn.

    Args:
        bench: the measured series.
        project: takes out what the model's own numbers explain.
    """
    if not bench.redrawn:
        return 0.0
    own, *there = bench.redrawn
    return SPARE * max(float(np.sum(project(bench.trace(own, one)) ** 2)) for one in there)


def led_by(bench: Bench, found: Fit, columns: Array) -> Array:
    """How far changes of the measured channels move a fit's numbers, shape (changes, p).

    Args:
        bench: the measured series, weighed.
        found: the fit.
        columns: the changes, whitened, shape (rows, changes).
    """
    own, priors = found.columns, Vector(found.state, tuple(found.frees), 0).priors()
    if found.beside is not None:
        own, priors = np.hstack([own, found.beside[0]]), np.concatenate([priors, found.beside[1]])
    rest = bench.stacked(bench.residuals(found.predictions))
    power = max(float(np.mean(rest**2)), 1e-30) * correlation(rest, bench.stacked_blocks())
    information = own.T @ own / power + np.diag(1.0 / priors**2)
    moves = np.linalg.solve(information, own.T @ columns / power)
    return np.asarray(moves[: found.columns.shape[1]].T)


def other_drives(bench: Bench, found: Fit, others: Sequence[State], own: State | None = None) -> Array | None:
    """How far a fit's numbers would be off, were the drive one of others, shape (others, p).

    Args:
        bench: the measured series, weighed.
        found: the fit.
        others: models whose numbers are those of the fit.
        own: the model that they are held against, where that is not the fit's.

    Returns:
        None where one of them cannot be predicted.
    """
    with bench.coarse():
        try:
            here, *there = [bench.predict(one) for one in [own or found.state, *others]]
        except PredictionError:
            return None
    return led_by(bench, found, np.column_stack([bench.trace(here, one) for one in there]))


def widen_by_flanks(bench: Bench, found: Fit) -> None:
    """Let the spread of a fit's numbers over other flanks widen their intervals.

    Other flanks move a number by as much in all blocks of time, so what is left does not show it.
    """
    others = drawn_anew(found.state)
    if not others or not found.columns.size:
        return
    moves = other_drives(bench, found, others)
    if moves is not None:
        found.covariance = found.covariance + spread_of_draws(moves)


def spread_of_draws(moves: Array) -> Array:
    """Covariance of numbers over other draws, whose double square root is a 95 % interval, shape (p, p).

    Args:
        moves: of each draw from the model's own, shape (draws, p).
    """
    from scipy.special import stdtrit

    return np.asarray(moves.T @ moves / len(moves) * (stdtrit(len(moves), 0.975) / 2.0) ** 2)
