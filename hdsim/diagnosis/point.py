"""Where the base is made linear: at its fitted numbers, at those that it was given with, or at any others."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace

import numpy as np

from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, at_present, fit
from hdsim.estimate.numbers import scaled
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.state import State
from hdsim.estimate.vector import Vector, sensitivities

#: Logarithm by which a re-fitted number may have moved before a fit begins at the given one too.
FAR = 0.7


@dataclass
class Point:
    """Where the base is linear: its numbers and those of the effects that it has, and what it leaves there.

    Attributes:
        theta: logarithms of factors on the fitted base's numbers, shape (f,).
        state: the base there.
        predictions: its predictions.
        columns: sensitivities to all numbers, shape (rows, p).
        left: whitened residual, shape (rows,).
    """

    theta: Array
    state: State
    predictions: list[Array]
    columns: Array
    left: Array


def point_at(bench: Bench, base: Fit, theta: Array) -> Point:
    """The base at other numbers of its own, shape (f,)."""
    frees = at_present(base)
    state = scaled(base.state, frees, theta.tolist())
    there = [free.moved(float(t)) for free, t in zip(frees, theta, strict=True)]
    vector = Vector(state, tuple(there), 0)
    predictions = bench.predict(state)
    return Point(
        theta, state, predictions, sensitivities(bench, vector, vector.start(), predictions, tangents=True),
        bench.stacked(bench.residuals(predictions)),
    )  # fmt: skip


def theta_given(found: Fit) -> Array:
    """The base's numbers as given, as logarithms of factors on a fit's, shape (f,); delays stay."""
    return np.array([0.0 if free.step else free.none for free in at_present(found)])


def given_point(bench: Bench, found: Fit) -> Point | None:
    """A fit's model with the base's numbers as given, whatever it began from; delays are no model's and stay.

    None where none of them has gone far, or where nothing can be predicted.
    """
    theta = theta_given(found)
    if np.any(np.abs(theta) > FAR):
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            return point_at(bench, found, theta)
    return None


def as_given(bench: Bench, found: Fit) -> Fit | None:
    """``given_point`` as a fit that has not begun."""
    there = given_point(bench, found)
    if there is None:
        return None
    frees = [free.moved(float(t)) for free, t in zip(at_present(found), there.theta, strict=True)]
    return replace(
        found, state=there.state, frees=frees, theta=np.zeros(len(frees)), predictions=there.predictions,
        columns=there.columns,
    )  # fmt: skip


def from_where_it_was(bench: Bench, base: Fit, earlier: Fit | None) -> dict[str, tuple[Fit, bool]]:
    """An only effect that was fitted before samples were left out, fitted on from there, as a contest has it.

    A base that was bent by all that is missing may be far from there, and the way long.

    Args:
        bench: the measured series, without those samples.
        base: the re-fitted model without effects.
        earlier: the fit beside the samples that count no more.
    """
    if earlier is None or len(earlier.state.added) != 1:
        return {}
    was, frees = {free.name: free.none for free in at_present(earlier)}, at_present(base)
    theta = {free.name: free.none - was[free.name] for free in frees if free.name in was}
    state = replace(base.state, added=earlier.state.added)
    with bench.coarse(), contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        found = fit(bench, state, frees, prune=False, theta=theta, after=base, rough=True)
        return {earlier.state.added[0].effect: (found, True)}
    return {}
