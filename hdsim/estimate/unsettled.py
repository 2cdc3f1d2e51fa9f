"""A fit that ends where its own slopes lead on: tiny changes part the predictions, no step leaves less."""

from __future__ import annotations

import math

from hdsim.effects import catalogue
from hdsim.estimate.bench import Bench
from hdsim.estimate.data_problems import Problem
from hdsim.estimate.fit import Fit
from hdsim.estimate.state import State


def unsettled(bench: Bench, found: Fit) -> list[Problem]:
    """A warning where a fit's intervals are of a point that is no minimum.

    At a minimum the slopes promise nothing. Where the numbers are each a standard error from it, they promise
    as much as there are numbers, in units of what an independent sample of the residual adds to the cost (the
    mean of a chi-square variable). A fit that stops before more than that has followed slopes which hold over
    no step: a load that is free in a play is where its last bounce left it, and bounces part.

    Args:
        bench: the measured series.
        found: the last fit, carried to its end.
    """
    count = found.columns.shape[1]
    if found.promised <= count:
        return []
    away = math.sqrt(found.promised / count)
    message = (
        f"the fit does not come to rest: its slopes lead on, by {away:.2g} standard errors of its numbers "
        "(root mean square), but no step along them leaves less: its intervals are too narrow"
    )
    if _has_play(found.state):
        message += (
            ". Tiny changes part what the model predicts, as of a load that is free in a play: learn from "
            "records in which a weight or a torque keeps the load to one flank"
        )
    return [Problem(bench.predictors[0].record.name, "model", "unsettled", "warning", message)]


def _has_play(state: State) -> bool:
    """Whether a model has a gap in which its load may be free."""
    known = catalogue()
    kinds = (known[name] for name in state.merged_effects())
    return state.toothed or any(way.play for kind in kinds for way in getattr(kind, "fittings", ()))
