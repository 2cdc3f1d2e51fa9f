"""What a model leaves that another reading of the measured motion would change as much: nothing more is told.

A play that rattles, or a spring that hardens, may follow two motions apart that differ by an encoder's noise
(Moon 1992, *Chaotic and Fractal Dynamics*, chapter 5). Of such a model not even the true numbers reach the
sensors' noise, and a fit bends it to one that answers to the motion less (``hdsim.estimate.motion_noise``).
So the effects that were found are asked beside the base's numbers as given too: where a record drawn anew
changes the prediction by as much as is left there, that model is not contradicted (parametric bootstrap:
Efron and Tibshirani 1993), and whatever else would explain what is left explains noise.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

import numpy as np

from hdsim.diagnosis.point import theta_given
from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.fit import Fit, at_present
from hdsim.estimate.motion_noise import answers
from hdsim.estimate.numbers import scaled
from hdsim.estimate.orders import Line, power_of
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.records import Array
from hdsim.estimate.refit import REACHED
from hdsim.estimate.state import State

#: Records drawn anew, of which one must change the prediction by as much as is left: a model that they
#: contradict is kept one time in ten.
DRAWS = 9
#: Part of what is left that the first of them changes at least where others may change as much (chosen).
HOPELESS = 0.1
#: Lines beside the channels.
LINES = "lines"


def within_motion_noise(bench: Bench, found: Fit, lines: Sequence[Line] = ()) -> bool:
    """Whether what a model leaves is no more than what the noise of motion and load makes of it.

    Args:
        bench: the measured series, weighed.
        found: the model; it is asked with its base's numbers as given, and as it is.
        lines: that stand out of what it leaves: of them alone, too.
    """
    if bench.power(found.predictions) <= REACHED * bench.noise_power:
        return False
    given = scaled(found.state, at_present(found), theta_given(found).tolist())
    with bench.coarse(), contextlib.suppress(PredictionError):
        return any(_not_contradicted(bench, state, lines) for state in (given, found.state))
    return False


def _not_contradicted(bench: Bench, state: State, lines: Sequence[Line]) -> bool:
    """Whether of some records drawn anew one changes as much, of each channel and of the lines."""
    left = _powers(bench, bench.residuals(bench.predict(state)), state, lines)
    missed = {what for what in left if left[what] > REACHED * bench.noise_powers.get(what, 0.0)}
    if not missed:
        return False  # numbers that explain all, where the fit has not come
    for s in bench.series:
        left[s.channel] -= float(s.train.sum()) * (s.sensor / s.sigma) ** 2
    for changes in answers(bench, state, DRAWS, everything=False):
        whole = [changes.get(k, np.zeros(len(s.measured))) for k, s in enumerate(bench.series)]
        changed = _powers(bench, bench.centred(whole), state, lines)
        missed -= {what for what in missed if changed[what] >= left[what]}
        if not missed:
            return True
        if any(changed[what] < HOPELESS * left[what] for what in missed):
            break
    return False


def _powers(bench: Bench, values: list[Array], state: State, lines: Sequence[Line]) -> dict[str, float]:
    """Power of residuals or changes in each channel, and in lines."""
    return bench.powers(values) | ({LINES: power_of(bench, values, lines, state.delays)} if lines else {})


def told_of_motion(bench: Bench) -> Problem:
    """The warning of a search that ended because of it."""
    message = (
        "what is left is no more than what another reading of the measured motion would change in a model "
        "with these effects: no further one is sought (with `--thorough` it is), and parameters may be bent "
        "to answer to it less"
    )
    return Problem(bench.predictors[0].record.name, "model", "motion", "warning", message)
