"""The model as given with its own numbers fitted, on as few readings as show what is missing.

Where much is missing, slower readings show it as well (``hdsim.estimate.thin``). How much, a first look at
what the model leaves tells before its numbers are carried to their end; what is left there is asked again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.refit import Refit, first_look, refit
from hdsim.estimate.state import State


def refitted(bench: Bench, start: State, begun: tuple[list[Array], Fit] | None = None) -> Refit:
    """The model with its own numbers fitted.

    Args:
        bench: the measured series.
        start: the model as given.
        begun: the first steps, where they have been taken.

    Raises:
        InputError: it cannot follow the motion.
    """
    try:
        return refit(bench, start, begun=begun)
    except PredictionError as error:
        names = ", ".join(p.record.name for p in bench.predictors[: bench.training])
        raise InputError(f"{names}: the model cannot follow the measured motion: {error}") from None


def on_few_readings(
    bench: Bench,
    start: State,
    readings: int,
    allowed: Callable[[Mapping[str, float]], int],
    opened: Callable[[int], Bench],
) -> tuple[Bench, Refit, int]:
    """The records by means of so many readings as what is missing allows, and the model fitted to them.

    Args:
        bench: the records by means that lose nothing but noise.
        start: the model as given.
        readings: of each of these means.
        allowed: how many may be taken where a model leaves that mean square of each channel beyond the noise.
        opened: the records by means of that many.

    Returns:
        The records, the fitted model and how many readings were taken.

    Raises:
        InputError: the model cannot follow the motion.
    """
    if allowed(dict.fromkeys(bench.channels, math.inf)) <= readings:
        return bench, refitted(bench, start), readings
    begun = _begun(bench, start)
    fewer = readings if begun is None else allowed(bench.beyond_noise(begun[1].predictions))
    if fewer > readings:
        few = opened(fewer)
        base = refitted(few, start)
        if allowed(few.beyond_noise(base.fit.predictions)) >= fewer:
            return few, base, fewer
    base = refitted(bench, start, begun)
    fewer = allowed(bench.beyond_noise(base.fit.predictions))
    if fewer <= readings:
        return bench, base, readings
    few = opened(fewer)
    return few, refitted(few, start), fewer


def _begun(bench: Bench, start: State) -> tuple[list[Array], Fit] | None:
    """The first steps of a re-fit; None where the model as given cannot be predicted."""
    try:
        return first_look(bench, start)
    except PredictionError:
        return None
