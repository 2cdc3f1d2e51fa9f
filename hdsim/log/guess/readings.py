"""What a column of angles or velocities may mean: its units and sides, each with how unusual it would be.

Costs are orders of magnitude of disbelief: 1 is ten times less usual. They order what the numbers leave
open, and never overrule them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdsim.errors import InputError
from hdsim.log.guess.findings import Candidate
from hdsim.log.guess.relations import Array, step_of, turn_of
from hdsim.log.units import ANGLE_UNITS, CURRENT_UNITS, TORQUE_UNITS, VELOCITY_UNITS, unit_of

#: Usual travel in rad and usual top speed in rad/s of either side; each decade above costs 1, below a half:
#: a locked drive and a slow test are no rarity.
USUAL = {
    ("angle", "output"): (1.0, 60.0),
    ("angle", "motor"): (3.0, 6000.0),
    ("velocity", "output"): (0.5, 12.0),
    ("velocity", "motor"): (5.0, 900.0),
}
#: Turns of encoders in counts: powers of two, and what optical discs have (with four edges a line).
TURNS = (*(2.0**n for n in range(8, 33)), 360.0, 500.0, 1000.0, 2000.0, 2500.0, 3600.0, 4000.0, 5000.0,
         7200.0, 8000.0, 10_000.0, 20_000.0, 36_000.0, 40_000.0, 100_000.0, 360_000.0)  # fmt: skip
#: Cost of a unit that the file contradicts, and of a column that no unit fits.
CONTRADICTED = 7.0
UNFIT = 9.0
_STEP_SHOWS = 6.0
#: Units of each quantity, as a mapping calls them.
UNITS = {
    "angle": (*ANGLE_UNITS, "count"),
    "velocity": (*VELOCITY_UNITS,),
    "torque": (*TORQUE_UNITS, *CURRENT_UNITS),
    "current": (*CURRENT_UNITS,),
    "temperature": ("degC", "K", "degF"),
}
_FAMILY = {
    "rad": "rad",
    "deg": "deg",
    "rad/s": "rad",
    "deg/s": "deg",
    "rpm": "",
    "rev": "",
    "rev/s": "",
    "count": "",
}


@dataclass(frozen=True)
class Reading:
    """A way to read a column.

    Args:
        unit: of the mapping.
        scale: rad, or rad/s, in one recorded unit.
        side: to which the numbers refer.
        cost: see the module.
        counts: counts in a turn, for the unit count.
        contradicts: the file says another unit.
    """

    unit: str
    scale: float
    side: str
    cost: float
    counts: float | None = None
    contradicts: bool = False

    def family(self) -> str:
        """``rad`` or ``deg``, of units that go together; "" for those that go with all."""
        return _FAMILY.get(self.unit, "")


def stated_unit(column: Candidate) -> str:
    """The unit that the user or the file says, as the mapping calls it, or "".

    Raises:
        InputError: the user says one that is none of the column's quantity.
    """
    if "unit" in column.said:
        said = column.said["unit"]
        allowed = UNITS.get(column.quantity, ())
        if said not in allowed:
            raise InputError(
                f"--set {column.label}.unit: found {said!r}, expected {', '.join(allowed) or 'no unit'} "
                f"(its quantity is {column.quantity or 'not known: say its channel'})"
            )
        return said
    known = unit_of(column.meaning.unit)
    fits = known is not None and known[0] in (
        column.quantity,
        "current" if column.quantity == "torque" else "",
    )
    return known[1] if known is not None and fits else ""


def readings(column: Candidate, values: Array, travel: float, many_axes: bool) -> list[Reading]:
    """Every way to read a column of angles or velocities.

    Args:
        column: it.
        values: its numbers.
        travel: their range or (for velocities) largest size, of the axis that moves most.
        many_axes: the file holds several axes, as a robot's log of its joints does.
    """
    kind = column.quantity
    known = ANGLE_UNITS if kind == "angle" else VELOCITY_UNITS
    stated = stated_unit(column)
    usual = {"rad": 0.0, "deg": 0.0, "rev": 1.0, "rad/s": 0.0, "deg/s": 0.0, "rpm": 0.0, "rev/s": 1.0}
    options: dict[str, float] = {unit: cost for unit, cost in usual.items() if unit in known}
    whole = bool(np.all(values[np.isfinite(values)] % 1 == 0))
    if kind == "angle":
        turn, step = turn_of(values), step_of(values)
        for unit, of_unit in (("rad", 2 * math.pi), ("deg", 360.0), ("rev", 1.0)):
            if turn is not None and not math.isclose(turn, of_unit, rel_tol=0.01):
                options[unit] += 4.0
            if step is not None and _binary(step / of_unit):
                options[unit] -= _STEP_SHOWS
            if whole and travel > 1000:
                options[unit] += 3.0
    contradicted = stated in known or stated == "count"
    found = []
    for side, of_side in _sides(column, many_axes).items():
        low, high = USUAL[kind, side]
        for unit, cost in options.items():
            beyond = _beyond(travel * known[unit], low, high)
            if stated == unit:
                found.append(Reading(unit, known[unit], side, of_side))
            elif "unit" not in column.said:
                extra = CONTRADICTED if contradicted else 0.0
                found.append(
                    Reading(unit, known[unit], side, of_side + cost + beyond + extra, None, contradicted)
                )
        if stated in known and stated not in options:
            found.append(Reading(stated, known[stated], side, of_side))
        if kind == "angle" and whole and stated in ("", "count"):
            found += _counted(column, values, side, of_side, travel, stated)
    return found


def _counted(
    column: Candidate, values: Array, side: str, of_side: float, travel: float, stated: str
) -> list[Reading]:
    said = column.said.get("counts_per_turn")
    turn = turn_of(values)
    low, high = USUAL["angle", side]
    found = []
    for counts in (float(said),) if said else TURNS:
        beyond = _beyond(travel * 2 * math.pi / counts, low, high)
        if turn is not None and not math.isclose(turn, counts, rel_tol=0.01):
            beyond += 4.0
        odd = 0.0 if math.log2(counts) % 1 == 0 else 0.5
        cost = of_side + (0.0 if said else beyond + odd) + (0.0 if stated else 1.0)
        found.append(Reading("count", 2 * math.pi / counts, side, cost, counts))
    return found


def _beyond(size: float, low: float, high: float) -> float:
    if size <= 0:
        return 0.0
    return max(math.log10(size / high), 0.5 * math.log10(low / size), 0.0)


def _sides(column: Candidate, many_axes: bool) -> dict[str, float]:
    """Sides to which the numbers may refer, and what each costs."""
    said = column.said.get("side") or (column.said.get("channel", "").split("_")[0])
    if said in ("motor", "output"):
        return {said: 0.0}
    own = physical_side(column)
    if own:
        # A motor's encoder may be told at the output, a joint's hardly at the motor.
        other = "output" if own == "motor" else "motor"
        return {own: 0.0, other: 2.5 if own == "motor" else 5.0}
    return {"output": 0.0, "motor": 2.5} if many_axes else {"output": 0.5, "motor": 0.5}


def physical_side(column: Candidate) -> str:
    """Side on which a column was measured, as far as the user or its name says."""
    channel = column.said.get("channel", "")
    if channel:
        return "motor" if channel.startswith("motor") else "output"
    return {"load": "output"}.get(column.meaning.side, column.meaning.side)


def _binary(share: float) -> bool:
    """Whether a step is a turn over a power of two, 256 to 2^28."""
    if share <= 0:
        return False
    power = -math.log2(share)
    return 8 <= power <= 28 and abs(power - round(power)) < 1e-4
