"""What other flanks of the same roughness would do: nobody knows the ones that a drive has.

A mesh with teeth draws each tooth's half-gap and pitch error (``hdsim.surface``), and the drive that was
measured has drawn its own. So a prediction is known up to what another draw changes, and what is no larger
is no effect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hdsim.drive.parameters import ToothedMesh
from hdsim.estimate.bench import Bench
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import State

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
