"""A vibration at the beginning of a record that shows once an effect is named.

Behind what is missing it is no larger than what follows (``hdsim.estimate.beginning``), and an effect that is
found beside it bends the model to it, its damping first of all. So each time that effects were found it is
asked once more whether a beginning leaves more than all that follows, and again when the model is fitted
without that. Where most of what was left goes with it, it does not count.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np

from hdsim.estimate.beginning import EARLY, hear_beginning
from hdsim.estimate.bench import Bench
from hdsim.estimate.fit import Fit, sharpened
from hdsim.estimate.free_swing import swinging
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.refit import MUCH, as_far_as_promised, together
from hdsim.estimate.series import Counted

#: Part of what a model leaves beyond the noise that is most of it.
MOST = 0.5
#: The same for a swing to be let go: of a model that is far off nobody knows it (chosen: with a half, one of
#: twelve diagnoses took twice the time, beside a swing twenty times too large).
FREED = 0.8


def hear_swing(bench: Bench, found: Fit) -> bool:
    """Leave out beginnings of records without which a model leaves less than half of what it did.

    Args:
        bench: the measured series, weighed; their masks are changed where that is so.
        found: the model with the effects that were found.

    Returns:
        Whether something was left out.
    """
    counted, begins_s = Counted(bench.series), dict(bench.begins_s)
    before = _beyond(bench, found)
    if before <= 0.0:
        return False
    # Whether half of it goes, a search's predictions tell.
    with bench.coarse(), contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        for _ in range(EARLY):
            if not hear_beginning(bench, found.predictions):
                break
            found = together(bench, found, rough=True)
        if bench.begins_s != begins_s and _beyond(bench, found) < (1.0 - MOST) * before:
            return True
    counted.put_back()
    bench.begins_s = begins_s
    return False


def let_swing(bench: Bench, found: Fit) -> Fit:
    """The model with loads that swing where records begin, where that leaves less than a fifth as much.

    Args:
        bench: the measured series, weighed; what is taken out of them is changed where that is so.
        found: the model with the effects that were found.
    """
    before = _beyond(bench, found)
    if before <= 0.0 or bench.swings:
        return found
    with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
        state, predictions = swinging(bench, found.state, found.predictions)
        if bench.swings:
            free = _carried_on(bench, replace(found, state=state, predictions=predictions), before)
            left, swings, bench.swings = _beyond(bench, free), bench.swings, {}
            # A fit that is carried on leaves less in any case.
            if left < (1.0 - FREED) * before:
                held = _carried_on(bench, found, before)
                if left < (1.0 - FREED) * _beyond(bench, held):
                    bench.swings = swings
                    return free
    bench.swings = {}
    return found


def _carried_on(bench: Bench, found: Fit, before: float) -> Fit:
    """The model carried on, as far as it promises where a first step leaves much less than ``before``."""
    on = together(bench, found, rough=True)
    if _beyond(bench, on) < (1.0 - MUCH) * before:
        on = as_far_as_promised(bench, sharpened(bench, on))
    return on


def _beyond(bench: Bench, found: Fit) -> float:
    """Power of what a model leaves beyond the noise."""
    return bench.power(found.predictions) - bench.noise_power
