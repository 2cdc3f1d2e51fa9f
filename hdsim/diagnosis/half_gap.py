"""The mean half-gap of a mesh with teeth, and its interval: nobody knows the teeth that a drive has.

What is seen is how the drive winds up around zero torque. The mean half-gap that this tells depends on the
flanks that the drive has drawn, on its engagement, and on which teeth have the wear: a gap that is wider by
the same in every tooth, and one that has grown in proportion to each tooth's own, wind up alike with other
means, for the teeth that have the least gap touch first. So the fit is made again for drives that may as well
be the measured one, and they count as multiple imputations of what is not known (Rubin 1987, Multiple
Imputation for Nonresponse in Surveys, Eq. 3.1.1 to 3.1.6). How wear shares itself out is no matter of chance:
the interval reaches from the least that one way allows to the most that another does.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pydantic import ValidationError

from hdsim.drive.parameters import ToothedMesh
from hdsim.drive.play_as_teeth import half_gap_of_play
from hdsim.effects import catalogue
from hdsim.effects._kernels import ARCMIN
from hdsim.estimate.covariance import robust_covariance
from hdsim.estimate.fit import at_present, fit
from hdsim.estimate.flanks import drawn_anew
from hdsim.estimate.predict import PredictionError
from hdsim.estimate.state import Added
from hdsim.estimate.vector import Vector

if TYPE_CHECKING:
    from hdsim.effects._fitting import Fitting
    from hdsim.estimate.bench import Bench
    from hdsim.estimate.fit import Fit
    from hdsim.estimate.records import Array
    from hdsim.estimate.state import State
    from hdsim.parts import OfTeeth

#: Evaluations of a fit with other teeth, which begins at the optimum of the model's own with the
#: sensitivities there.
EVALUATIONS = 6
#: Power that it may leave, in units of the least, to be a drive that may have been measured.
LEFT_IN = 2.0


def own_half_gap(state: State) -> float:
    """Mean half-gap of a model's flanks, m."""
    mesh, drive = state.drive.mesh, state.drive
    if mesh.half_gap_m is not None:
        return float(mesh.gap_factor * mesh.half_gap_m)
    return float(
        mesh.gap_factor * np.mean(mesh.flanks.half_gaps(drive.geometry.flexspline_teeth, state.seed))
    )


def half_gap_with(of: OfTeeth, state: State, value: float) -> float:
    """Mean half-gap of a model's flanks with a field of an effect at a value, m."""
    own = own_half_gap(state)
    if of.says == "growth":
        return own * (1.0 + value)
    return own + of.play_arcmin * half_gap_of_play(state.drive, value * ARCMIN)


def _value(of: OfTeeth, state: State, half_gap_m: float) -> float:
    """The field of an effect at which the mean half-gap is a given one."""
    own = own_half_gap(state)
    if of.says == "growth":
        return half_gap_m / own - 1.0
    return (half_gap_m - own) / (of.play_arcmin * half_gap_of_play(state.drive, ARCMIN))


def half_gap_ends(
    bench: Bench, found: Fit, effect: str, of: OfTeeth, value: float
) -> tuple[float, float] | None:
    """Ends of the mean half-gap's 95 % interval, m; None where the fit does not tell it.

    Args:
        bench: the measured series.
        found: the model with the effect.
        effect: its name.
        of: what its field says of the teeth.
        value: of that field.
    """
    state = found.state
    names = [added.effect for added in state.added]
    if not isinstance(state.drive.mesh, ToothedMesh) or effect not in names or not found.columns.size:
        return None
    k = names.index(effect)
    at = found.numbers_of(k)
    if at.stop - at.start != 1 or state.added[k].coefficients[0] == 0.0:
        return None
    gap = half_gap_with(of, state, value)
    # Widths and growths are proportional to their coefficient.
    slope = (gap - own_half_gap(state)) / state.added[k].coefficients[0]
    rest = bench.stacked(bench.residuals(found.predictions))
    priors = Vector(state, tuple(found.frees), 0).priors()
    # The fit's own covariance has other drives in it, by what they would move it were it linear.
    alone = robust_covariance(found.columns, rest, bench.stacked_blocks(), priors, found.beside)
    within = slope**2 * float(alone[at.start, at.start])
    ends: list[float] = []
    with bench.coarse():
        for whole in (found, *_worn_otherwise(bench, found, k, of, gap)):
            ends += _imputed(_told(bench, whole, k), within)
    return max(min(ends), 0.0), max(ends)


def _imputed(told: Array, within: float) -> tuple[float, float]:
    """Ends of a 95 % interval from what each imputation tells, shape (m,), and the variance within one."""
    from scipy.special import stdtrit

    m, between = len(told), 0.0
    if m > 1:
        # In the units of a variance within, whose double root is a 95 % interval.
        between = (1.0 + 1.0 / m) * float(np.var(told, ddof=1)) * (stdtrit(m - 1, 0.975) / 2.0) ** 2
    half = 2.0 * math.sqrt(within + between)
    return float(told.mean()) - half, float(told.mean()) + half


def _told(bench: Bench, whole: Fit, k: int) -> Array:
    """Mean half-gaps, m, by a fit and by those of drives with other teeth that explain the data as well."""
    fits = [whole]
    for other in drawn_anew(whole.state, engaged=True, fitted=whole.frees):
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            fits.append(
                fit(bench, other, at_present(whole), prune=False, evaluations=EVALUATIONS, after=whole,
                    known=(whole.columns, math.nan), rough=True)
            )  # fmt: skip
    powers = [bench.power(each.predictions) for each in fits]
    likely = [each for each, power in zip(fits, powers, strict=True) if power <= LEFT_IN * min(powers)]
    return np.array([_half_gap_of(each.state, k) for each in likely])


def _half_gap_of(state: State, k: int) -> float:
    """Mean half-gap that an added effect leaves, m."""
    added = state.added[k]
    of = catalogue()[added.effect].of_teeth
    assert of is not None
    return half_gap_with(of, state, added.settings()[of.field])


def _worn_otherwise(bench: Bench, found: Fit, k: int, of: OfTeeth, gap: float) -> Iterator[Fit]:
    """Fits with the other ways in which gaps can have changed, each from the same mean half-gap."""
    state = found.state
    taken = {*state.effects, *(added.effect for added in state.added)}
    for name, effect in catalogue().items():
        says = effect.of_teeth
        if says is None or says.says not in ("play", "growth") or says.says == of.says or name in taken:
            continue
        value = _value(says, state, gap)
        try:
            effect(**{says.field: value})
        except ValidationError:
            continue  # an effect that only widens says nothing of narrower gaps
        fittings: tuple[Fitting, ...] = getattr(effect, "fittings", ())
        fitting = next(each for each in fittings if each.of_mesh(True))
        unit = Added(name, fitting, (1.0,))
        one = replace(unit, coefficients=(value / unit.settings()[says.field],))
        other = replace(state, added=(*state.added[:k], one, *state.added[k + 1 :]))
        with contextlib.suppress(PredictionError, np.linalg.LinAlgError):
            yield fit(bench, other, at_present(found), prune=False, after=found, rough=True)
