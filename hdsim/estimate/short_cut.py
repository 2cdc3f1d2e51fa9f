"""The short cut of predictions with teeth: what it leaves out, and how far off that is.

A toothed ring is a light body between two stiff springs: its modes lie at tens of kilohertz, where no
sensor of a drive hears anything. A prediction therefore

* resolves the ring's twist, and its speed only by what it does to that twist (``Model.seen_scale``);
* takes the base's own teeth, and those of the model that a search has come to, from tables that are made
  once; teeth that a fit is moving are summed, unless one of them is out of place;
* of a ring that next to nothing damps takes the static balance (``Drive.settled``).

The first two are compared with the whole model, teeth summed and the ring's speed followed ten times more
closely, on the data's own motion, in units of the noise. Where they make more than ``LIMIT`` of it they are
not taken. Following the ring to the end moves the whole model by a tenth of its distance from the short cut,
for three times its cost.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.parameters import TabulatedMesh, TeethMesh
from hdsim.errors import InputError, PhysicsError
from hdsim.estimate.found import ShortCut
from hdsim.estimate.predict import Candidate, PredictionError

if TYPE_CHECKING:
    from hdsim.estimate.bench import Bench
    from hdsim.estimate.records import Array
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
            predictor.table_for = frozenset({table_for})
        short = bench.predict(state)
        with whole_models(bench):
            whole = bench.predict(state)
    except PredictionError:
        return  # whoever predicts it next says so
    error = _error(bench, short, whole)
    if max(error.values(), default=0.0) > LIMIT:
        bench.refused = error
        for predictor in bench.predictors:
            predictor.whole = True


def follow_teeth(bench: Bench, base: State, state: State) -> None:
    """Let a fitted model's own teeth be taken from a table as well: a whole search follows from there.

    Args:
        bench: the measured series; its predictors are changed.
        base: the re-fitted model.
        state: the fitted model.
    """
    if bench.predictors[0].table_for is None or bench.refused:
        return
    known = {_fingerprint(each.candidate()) for each in (base, state)}
    for predictor in bench.predictors:
        predictor.table_for = frozenset(one for one in known if one is not None)


def short_cut_of(bench: Bench, short: Sequence[Array], whole: Sequence[Array]) -> ShortCut | None:
    """What the short cut did to the predictions of the training records; None of a base without teeth.

    Args:
        bench: the measured series.
        short: their predictions by a model.
        whole: by the same model without the short cut.
    """
    if bench.predictors[0].table_for is None:
        return None
    if bench.refused:
        return ShortCut(taken=False, error=bench.refused)
    return ShortCut(taken=True, error=_error(bench, short, whole))


def _error(bench: Bench, short: Sequence[Array], whole: Sequence[Array]) -> dict[str, float]:
    """By channel the largest standard deviation of a record, as a part of the noise."""
    found: dict[str, float] = {}
    for series, here, there in zip(bench.series, short, whole, strict=True):
        if len(here) and series.train.any():
            part = float(np.std((here - there)[series.train])) / series.noise
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
