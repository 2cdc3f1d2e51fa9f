"""What a verdict says of teeth: which one is out of place, what a play means, the drive that has it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hdsim.diagnosis.half_gap import half_gap_ends, half_gap_with, own_half_gap
from hdsim.diagnosis.other_spline import of_other_spline
from hdsim.diagnosis.verdict import IdentifiedEffect, TeethFound
from hdsim.drive.parameters import LumpedMesh, ToothedMesh
from hdsim.drive.play_as_teeth import PlayAsTeeth, half_gap_of_play, play_as_teeth
from hdsim.effects import catalogue
from hdsim.effects._kernels import ARCMIN
from hdsim.errors import PhysicsError
from hdsim.estimate.found import ParameterEstimate

if TYPE_CHECKING:
    from hdsim.estimate.bench import Bench
    from hdsim.estimate.fit import Fit
    from hdsim.estimate.state import State
    from hdsim.parts import OfTeeth


def teeth_found(
    effects: Sequence[IdentifiedEffect], state: State, data: tuple[Bench, Fit] | None = None
) -> TeethFound | None:
    """What the named effects say of the teeth; None where they say nothing.

    Args:
        effects: as named.
        state: the model with them.
        data: the measured series and the fit that the state is of; without, a half-gap's interval holds for
            the model's own flanks and engagement alone.
    """
    found = TeethFound()
    for effect in effects:
        of = catalogue()[effect.name].of_teeth
        if of is None or of.field not in effect.parameters:
            continue
        if of.says == "place":
            _place(found, effect, of, state, data)
        elif isinstance(state.drive.mesh, ToothedMesh):
            _gap(found, effect, of, state, data)
        elif isinstance(state.drive.mesh, LumpedMesh) and of.play_arcmin > 0.0:
            _play(found, effect, of, state)
    return found if found.sentences else None


def _place(
    found: TeethFound, effect: IdentifiedEffect, of: OfTeeth, state: State, data: tuple[Bench, Fit] | None
) -> None:
    """The number of a tooth on its spline, from 0; its opposite one acts at the same time."""
    member = str(effect.settings.get("member", "flexspline"))
    number, count = _within_half_a_turn(effect.parameters[of.field], member, state)
    found.member, found.tooth = member, number
    found.opposite = (number.value + 0.5 * count) % count
    found.sentences.append(
        f"It is tooth {number.value:.0f}{_ends_of(number)} of the {member.replace('_', ' ')}, counted from "
        "the one on the wave generator's lobe at zero angles, or the opposite one, tooth "
        f"{found.opposite:.0f}: both lobes press alike."
    )
    names = [added.effect for added in state.added]
    if data is None or effect.name not in names:
        return
    bench, whole = data
    other = of_other_spline(bench, whole, names.index(effect.name), of.field)
    if other is None:
        return
    found.or_member = other[0]
    found.or_tooth, _ = _within_half_a_turn(other[1], other[0], state)
    found.sentences.append(
        f"Or it is tooth {found.or_tooth.value:.0f}{_ends_of(found.or_tooth)} of the "
        f"{other[0].replace('_', ' ')}, which explains the data as well: in {bench.turns:.2g} turns of the "
        "wave generator the teeth of the two splines hardly move past each other."
    )


def _within_half_a_turn(
    number: ParameterEstimate, member: str, state: State
) -> tuple[ParameterEstimate, int]:
    """A tooth's number below that of its opposite one, and how many teeth its spline has."""
    geometry = state.drive.geometry
    count = geometry.circular_spline_teeth if member == "circular_spline" else geometry.flexspline_teeth
    turns = math.floor(number.value / (0.5 * count)) * 0.5 * count
    interval = None if number.interval is None else (number.interval[0] - turns, number.interval[1] - turns)
    return ParameterEstimate(value=number.value - turns, interval=interval), count


def _ends_of(number: ParameterEstimate) -> str:
    return "" if number.interval is None else f" ({number.interval[0]:.0f} to {number.interval[1]:.0f})"


def _gap(
    found: TeethFound, effect: IdentifiedEffect, of: OfTeeth, state: State, data: tuple[Bench, Fit] | None
) -> None:
    """The mean half-gap of a mesh with teeth."""
    change = effect.parameters[of.field]
    gap, *ends = (half_gap_with(of, state, end) for end in (change.value, *(change.interval or ())))
    whole = half_gap_ends(*data, effect.name, of, change.value) if data is not None and ends else None
    ends = list(whole or ends)
    start = 1e6 * own_half_gap(state)
    found.half_gap_um = ParameterEstimate(
        value=1e6 * gap, interval=(1e6 * min(ends), 1e6 * max(ends)) if ends else None, start=start
    )
    said = "With the model's engagement and flanks the" if whole is None else "The"
    unknown = "" if whole is None else ", whatever flanks the drive has drawn and whichever are worn,"
    found.sentences.append(
        f"{said} teeth's mean half-gap is {1e6 * gap:.3g} µm{_ends(found.half_gap_um)}{unknown} instead of "
        f"{start:.3g}."
    )


def _play(found: TeethFound, effect: IdentifiedEffect, of: OfTeeth, state: State) -> None:
    """What a play means in teeth, and the drive with teeth that has it."""
    play = effect.parameters[of.field]
    ends = [of.play_arcmin * end * ARCMIN for end in (play.value, *(play.interval or ()))]
    gaps = [1e6 * half_gap_of_play(state.drive, end) for end in ends]
    found.half_gap_um = ParameterEstimate(value=gaps[0], interval=(gaps[1], gaps[2]) if gaps[1:] else None)
    radius = 1e3 * state.drive.geometry.pitch_radius_m
    said = (
        f"Between teeth this play is a mean half-gap of {gaps[0]:.3g} µm{_ends(found.half_gap_um)} at a "
        f"pitch radius of {radius:.4g} mm"
    )
    try:
        teeth = play_as_teeth(state.drive, ends[0], seed=state.seed)
    except PhysicsError as error:
        found.sentences.append(f"{said}. No drive with teeth is written: {error}.")
        return
    found.roughness_m = teeth.roughness_m
    found.sentences.append(f"{said}; by the law of the surfaces {_rough(teeth)}")


def _rough(teeth: PlayAsTeeth) -> str:
    flanks = " and ".join(
        f"G = {value:.3g} m of the {name.replace('_', ' ')} (D = {teeth.dimensions[name]:.4g})"
        for name, value in teeth.roughness_m.items()
    )
    said = f"that is {flanks}, flanks {teeth.heights:.3g} times as high as nominal ones."
    if not teeth.rough:
        said += (
            " So rough ones would be plastic at the mean tooth load of the rated torque: it is wear, and the "
            "written drive has nominal flanks worn apart."
        )
    return said


def _ends(number: ParameterEstimate) -> str:
    return f" ({number.interval[0]:.3g} to {number.interval[1]:.3g})" if number.interval else ""


def toothed_changes(effects: Sequence[IdentifiedEffect], state: State) -> dict[str, Any] | None:
    """What turns the scenario that was found into one whose teeth have the play; None where there is none.

    Args:
        effects: as named.
        state: the model with them.
    """
    if not isinstance(state.drive.mesh, LumpedMesh):
        return None
    for effect in effects:
        of = catalogue()[effect.name].of_teeth
        if of is None or of.play_arcmin <= 0.0 or of.field not in effect.parameters:
            continue
        play = of.play_arcmin * effect.parameters[of.field].value * ARCMIN
        try:
            teeth = play_as_teeth(state.drive, play, seed=state.seed)
        except PhysicsError:
            return None
        return {"drive": teeth.changes, "effects": {effect.name: None}}
    return None
