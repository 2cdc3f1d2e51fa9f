"""The mean half-gap of a mesh with teeth, and its interval: nobody knows the teeth that a drive has.

What is seen is how the drive winds up around zero torque. The mean half-gap that this tells depends on the
flanks that the drive has drawn, on its engagement, and on which teeth have the wear: a gap that is wider by
the same in every tooth, and one that has grown in proportion to each tooth's own, wind up alike with other
means, for the teeth that have the least gap touch first. So each is asked how far off the estimate would be
if it were so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from pydantic import ValidationError

from hdsim.drive.parameters import ToothedMesh
from hdsim.drive.play_as_teeth import half_gap_of_play
from hdsim.effects import catalogue
from hdsim.effects._kernels import ARCMIN
from hdsim.estimate.flanks import drawn_anew, led_by, other_drives, spread_of_draws
from hdsim.estimate.numbers import undeclared
from hdsim.estimate.vector import Vector, sensitivities

if TYPE_CHECKING:
    from hdsim.estimate.bench import Bench
    from hdsim.estimate.fit import Fit
    from hdsim.estimate.records import Array
    from hdsim.estimate.state import State
    from hdsim.parts import OfTeeth

#: Times that the mean half-gap of another wear is put right: the first is off by an eighth of the difference.
AGAIN = 2


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

    def moved(moves: Array) -> Array:
        return np.asarray(slope * moves[:, at.start])

    variance = slope**2 * float(found.covariance[at.start, at.start])
    variance += float(np.sum(moved(_engagement(bench, found)) ** 2))
    wears = [_Wear(gap, state, of, value)]
    if drawn_anew(state):
        moves = other_drives(bench, found, drawn_anew(state))
        if moves is None:
            return None
        # The fit's covariance holds other flanks by what they move, not that their own gaps differ.
        variance -= float(spread_of_draws(moved(moves)[:, None])[0, 0])
        wears += _elsewhere(bench, found, k, of, gap, moved)
    ends = []
    for wear in wears:
        half = 2.0 * math.sqrt(max(variance + _of_flanks(bench, found, wear, moved), 0.0))
        ends += [wear.half_gap_m - half, wear.half_gap_m + half]
    return max(min(ends), 0.0), max(ends)


@dataclass(frozen=True)
class _Wear:
    """A way in which the gaps may have grown: the mean half-gap, a model, and what says so there."""

    half_gap_m: float
    state: State
    of: OfTeeth
    value: float


def _of_flanks(bench: Bench, found: Fit, wear: _Wear, moved: Callable[[Array], Array]) -> float:
    """Variance of the estimate over other flanks, whose differences grow where each gap does, m^2."""
    others = drawn_anew(wear.state)
    moves = other_drives(bench, found, others, wear.state) if others else None
    if moves is None:
        return 0.0
    gaps = np.array([half_gap_with(wear.of, one, wear.value) for one in others]) - wear.half_gap_m
    return float(spread_of_draws((moved(moves) - gaps)[:, None])[0, 0])


def _engagement(bench: Bench, found: Fit) -> Array:
    """How far the engagement's numbers, each off by its prior spread, move a fit's, shape (numbers, p)."""
    state = found.state
    section = "drive.mesh.engagement"
    paths = [f"{section}.{name}" for name in type(state.drive.mesh.engagement).model_fields]
    frees = [free for path in paths if (free := undeclared(state, path, math.nan))]
    frees = [free for free in frees if math.isfinite(free.prior)]
    if not frees:
        return np.zeros((0, found.columns.shape[1]))
    unknown = Vector(state, tuple(frees), len(state.added))
    columns = sensitivities(bench, unknown, unknown.start(), found.predictions)
    return led_by(bench, found, columns * unknown.priors())


def _elsewhere(
    bench: Bench, found: Fit, k: int, of: OfTeeth, gap: float, moved: Callable[[Array], Array]
) -> list[_Wear]:
    """Other ways to grow with the same wind-up, each with its own mean half-gap."""
    state = found.state
    rest = replace(state, added=(*state.added[:k], *state.added[k + 1 :]))
    taken = {*state.effects, *(added.effect for added in rest.added)}
    wears = []
    for name, effect in catalogue().items():
        says = effect.of_teeth
        if says is None or says.says not in ("play", "growth") or says.says == of.says or name in taken:
            continue
        mean = gap
        try:
            for _ in range(AGAIN):
                like = _with(rest, name, says, mean)
                same = _with(rest, state.added[k].effect, of, mean)
                moves = other_drives(bench, found, [like], same)
                if moves is None:
                    break
                mean = gap - float(moved(moves)[0])
            there = _with(rest, name, says, mean)
        except ValidationError:
            continue  # an effect that only widens says nothing of narrower gaps
        wears.append(_Wear(mean, there, says, _value(says, rest, mean)))
    return wears


def _with(state: State, name: str, of: OfTeeth, half_gap_m: float) -> State:
    """The model with an effect that leaves a mean half-gap.

    Raises:
        ValidationError: it cannot.
    """
    effect = catalogue()[name](**{of.field: _value(of, state, half_gap_m)})
    return replace(state, effects=state.effects | {name: effect})
