"""What other flanks of the same roughness would do: nobody knows the ones that a drive has.

A mesh with teeth draws each tooth's half-gap and pitch error (``hdsim.surface``), and the drive that was
measured has drawn its own. So a prediction is known up to what another draw changes, and what is no larger
is no effect. Intervals hold the engagement as well, by the prior spreads of its fields: how many teeth carry
the load stands in no catalogue.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.parameters import ToothedMesh
from hdsim.estimate.bench import Bench
from hdsim.estimate.noise import usual_size
from hdsim.estimate.numbers import Free, scaled, undeclared
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


def drawn_anew(state: State, *, engaged: bool = False, fitted: Sequence[Free] = ()) -> list[State]:
    """The model with other flanks; none where nothing of its teeth is drawn.

    Args:
        state: the model.
        engaged: draw the engagement's numbers from their priors, too.
        fitted: numbers that a fit of the model moves: those of the engagement are known by it, not drawn.
    """
    mesh = state.drive.mesh
    if not isinstance(mesh, ToothedMesh):
        return []
    if mesh.pitch_error_m == 0.0 and (mesh.half_gap_m is not None or mesh.flanks.backlash == "single"):
        return []
    flanks = mesh.flanks.model_copy(update={"seed": None})
    drive = state.drive.model_copy(update={"mesh": mesh.model_copy(update={"flanks": flanks})})
    rng = np.random.default_rng([state.seed, 31])
    others = [replace(state, drive=drive, seed=int(seed)) for seed in rng.integers(2**31, size=DRAWS)]
    known = {free.name for free in fitted}
    return [_engaged(other, rng, known) for other in others] if engaged else others


def _engaged(state: State, rng: np.random.Generator, known: Collection[str]) -> State:
    """The model with its engagement's unknown numbers drawn from their priors, within what fields allow."""
    section = "drive.mesh.engagement"
    paths = [f"{section}.{name}" for name in type(state.drive.mesh.engagement).model_fields]
    paths = [path for path in paths if path not in known]
    frees = [free for path in paths if (free := undeclared(state, path, 0.0)) and free.prior > 0]
    thetas = [float(np.clip(free.prior * rng.standard_normal(), *free.bounds)) for free in frees]
    return scaled(state, frees, thetas)


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
    predicted = _predicted(bench, [state, *others], everything=True)
    bench.redrawn = [one for one in predicted if one is not None]
    if predicted[0] is None or len(bench.redrawn) < 2:
        bench.redrawn = []
        return
    own, *there = bench.redrawn
    left: dict[str, float] = {}
    for series, rest in zip(bench.series, bench.residuals(own), strict=True):
        if series.train.any():
            # The median: the stretches that something missing stirs up least.
            size = usual_size(rest[series.train])
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


def nothing_but_flanks(bench: Bench, power: float, project: Callable[[Array], Array]) -> bool:
    """Whether a whitened power beyond the noise, the most that an effect could explain, is only flanks'.

    Where it lies is not asked: what a wider gap leaves is no curve over one coordinate.
    """
    return only_flanks(bench, power - bench.noise_power, project)


def of_other_flanks(
    bench: Bench, project: Callable[[Array], Array], traces: Sequence[Array] | None = None
) -> float:
    """Whitened power beyond which a change is more than other flanks do; 0 where none are drawn.

    Args:
        bench: the measured series.
        project: takes out what the model's own numbers explain.
        traces: of all effects that are searched, shape (rows, k) each: only what the one that explains most
            takes for its own counts. What a search finds in other flanks is that, and no effect explains all.
    """
    if not bench.redrawn:
        return 0.0
    own, *there = bench.redrawn
    changes = project(np.column_stack([bench.trace(own, one) for one in there]))
    if traces is None:
        return SPARE * float(np.max(np.sum(changes**2, axis=0)))
    found = 0.0
    for columns in traces:
        along, _ = np.linalg.qr(project(columns))
        found = max(found, float(np.max(np.sum((along.T @ changes) ** 2, axis=0))))
    return SPARE * found


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
    power = bench.sample_power(rest)
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
        A row of nan for one that cannot be predicted (its teeth alone may be softer than the whole drive is
        known to be); None where that is so of all, or of the model itself.
    """
    here, *there = _predicted(bench, [own or found.state, *others])
    known = [k for k, one in enumerate(there) if one is not None]
    if here is None or not known:
        return None
    changes = [bench.trace(here, one) for one in there if one is not None]
    moves = np.full((len(others), found.columns.shape[1]), np.nan)
    moves[known] = led_by(bench, found, np.column_stack(changes))
    return moves


def _predicted(
    bench: Bench, states: Sequence[State], *, everything: bool = False
) -> list[list[Array] | None]:
    """What each model predicts with the tolerance of a search; None where it cannot be."""
    predicted: list[list[Array] | None] = []
    with bench.coarse():
        for state in states:
            try:
                predicted.append(bench.predict(state, everything=everything))
            except PredictionError:
                predicted.append(None)
    return predicted


def widen_by_flanks(bench: Bench, found: Fit) -> None:
    """Let the spread of a fit's numbers over other flanks and engagements widen their intervals.

    They move a number by as much in all blocks of time, so what is left does not show it.
    """
    others = drawn_anew(found.state, engaged=True, fitted=found.frees)
    if not others or not found.columns.size:
        return
    moves = other_drives(bench, found, others)
    if moves is not None:
        found.covariance = found.covariance + spread_of_draws(moves)


def spread_of_draws(moves: Array) -> Array:
    """Covariance of numbers over other draws, whose double square root is a 95 % interval, shape (p, p).

    Args:
        moves: of each draw from the model's own, shape (draws, p); rows of nan do not count.
    """
    from scipy.special import stdtrit

    moves = moves[np.isfinite(moves).all(axis=1)]
    return np.asarray(moves.T @ moves / len(moves) * (stdtrit(len(moves), 0.975) / 2.0) ** 2)
