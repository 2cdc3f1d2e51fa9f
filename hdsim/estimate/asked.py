"""Numbers of the base that one effect asks for: its trace depends on them, and little else in a record does.

How many teeth carry the load, and over how many an arc's edge rises, stands in no catalogue and hardly shows
in a drive whose teeth are alike. One tooth out of place is felt for as long as its arc is: its bump is as
wide and as steep as they are, and one that is held as wide as the model's leaves a residual of many orders,
and is drawn to where it covers most of the true one. Such numbers are nuisances of the effect (Kennedy and
O'Hagan 2001, Journal of the Royal Statistical Society B 63:425, on calibration): a fit of it moves them, with
the prior spreads of their fields, and they go back to what was given when it goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdsim.estimate.fit import Fit, at_present
from hdsim.estimate.numbers import Free, scaled, undeclared
from hdsim.estimate.state import Added, State


def asked_for(state: State, added: Sequence[Added]) -> list[Free]:
    """Numbers of the base that effects ask for, at the state's own values."""
    paths = dict.fromkeys(path for one in added for path in one.fitting.asks)
    return [free for path in paths if (free := undeclared(state, path, 0.0)) is not None]


def asked_beside(found: Fit, added: Added) -> list[Free]:
    """What an effect asks for and a fit without it has not asked yet."""
    there = {free.name for free in [*found.frees, *found.undetermined]}
    return [free for free in asked_for(found.state, [added]) if free.name not in there]


def gone_with(found: Fit, k: int) -> Fit:
    """A fit whose effect number ``k`` is gone, before anything is fitted anew.

    Its numbers, and what only it has asked for, are no longer there; the latter are as given again. The
    predictions stay those of the model with it.
    """
    state = found.state
    added = (*state.added[:k], *state.added[k + 1 :])
    stay = {path for one in added for path in one.fitting.asks}
    asked = {path for path in state.added[k].fitting.asks if path not in stay}
    frees = at_present(found)
    leave = [j for j, free in enumerate(frees) if free.name in asked]
    back = [frees[j] for j in leave]
    own = found.numbers_of(k)
    columns = np.delete(found.columns, [*leave, *range(own.start, own.stop)], axis=1)
    keep = [j for j in range(len(frees)) if j not in leave]
    undetermined = [free for free in found.undetermined if free.name not in asked]
    state = scaled(replace(state, added=added), back, [free.none for free in back])
    return replace(
        found,
        state=state,
        frees=[frees[j] for j in keep],
        theta=np.zeros(len(keep)),
        columns=columns,
        covariance=np.zeros((columns.shape[1],) * 2),
        beside=found.beside if len(undetermined) == len(found.undetermined) else None,
        undetermined=undetermined,
    )
