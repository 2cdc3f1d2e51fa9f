"""The short cut of predictions with teeth: what it leaves out, and how far off that is.

A toothed ring is a light body between two stiff springs: its modes lie at tens of kilohertz, where no
sensor of a drive hears anything. A prediction therefore

* resolves the ring's twist, and its speed only by what it does to that twist (``Model.seen_scale``);
* takes the base's own teeth from a table that is made once; teeth that a fit has moved are summed;
* of a ring that next to nothing damps takes the static balance (``Drive.settled``).

The first two are compared with the whole model, ring and teeth resolved, on the data's own motion, in units
of the noise. Where they make more than ``LIMIT`` of it they are not taken.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.parameters import TabulatedMesh, TeethMesh
from hdsim.errors import InputError, PhysicsError
from hdsim.estimate.predict import Candidate, PredictionError

if TYPE_CHECKING:
    from hdsim.estimate.bench import Bench
    from hdsim.estimate.state import State

#: Largest error of the short cut, as a part of the noise: that much adds half a per cent to it.
LIMIT = 0.1


def take_short_cut(bench: Bench, state: State) -> None:
    """Let the predictions of a bench take the short cut, where that is allowed.

    Args:
        bench: the measured series; its predictors are changed.
        state: the base model.
    """
    try:
        table_for = _fingerprint(state.candidate())
        if table_for is None:
            return
        for predictor in bench.predictors:
            predictor.table_for = table_for
        if max(short_cut_error(bench, state).values(), default=0.0) > LIMIT:
            for predictor in bench.predictors:
                predictor.whole = True
    except PredictionError:
        return  # whoever predicts it next says so


def short_cut_error(bench: Bench, state: State) -> dict[str, float]:
    """What the short cut does to the predictions of the training records; empty where none is taken.

    Args:
        bench: the measured series.
        state: the model.

    Returns:
        By channel the largest standard deviation of a record, as a part of the noise.

    Raises:
        PredictionError: the model could not be predicted.
    """
    first = bench.predictors[0]
    if first.whole or not isinstance(state.drive.mesh, TeethMesh | TabulatedMesh):
        return {}
    short = bench.predict(state)
    with whole_models(bench):
        apart = [a - b for a, b in zip(short, bench.predict(state), strict=True)]
    found: dict[str, float] = {}
    for series, away in zip(bench.series, apart, strict=True):
        if len(away) and series.train.any():
            part = float(np.std(away[series.train])) / series.noise
            found[series.channel] = max(part, found.get(series.channel, 0.0))
    return found


@contextlib.contextmanager
def whole_models(bench: Bench) -> Iterator[None]:
    """Predict without the short cut."""
    kept = [predictor.whole for predictor in bench.predictors]
    for predictor in bench.predictors:
        predictor.whole = True
    try:
        yield
    finally:
        for predictor, whole in zip(bench.predictors, kept, strict=True):
            predictor.whole = whole


def _fingerprint(candidate: Candidate) -> str | None:
    """That of a model's teeth; None where it has none."""
    from hdsim.drive.model import Model

    if not isinstance(candidate.drive.mesh, TeethMesh | TabulatedMesh):
        return None
    parts = [*candidate.effects.values()]
    try:
        model = Model(candidate.drive, parts, load_inertia_kg_m2=1.0, seed=candidate.seed, audited=False)
    except (InputError, PhysicsError):
        return None
    return model.teeth.fingerprint if model.teeth is not None else None
