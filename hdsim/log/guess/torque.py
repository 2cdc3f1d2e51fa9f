"""Torques and currents of one axis: whose they are, and to which side they refer."""

from __future__ import annotations

import numpy as np

from hdsim.log.guess.findings import Answer, Candidate, Channel, Draft, Ground
from hdsim.log.guess.readings import stated_unit
from hdsim.log.guess.relations import moves, slope
from hdsim.log.units import CURRENT_UNITS, TORQUE_UNITS

#: Torque constants of motors that drive harmonic drives lie below this, N m/A; a larger one refers to the
#: output.
LARGEST_CONSTANT = 1.0
#: Largest torque of such motors at their own shaft, N m.
LARGEST_MOTOR = 30.0
#: Two torques that differ by no more than this factor refer to the same side.
_SAME = 4.0
_PROPORTIONAL = 0.9
_EXACT = 0.9999


def map_torques(columns: list[Candidate], ratio: float | None, draft: Draft) -> None:
    """Add the channels of torque to the draft."""
    alive = [c for c in columns if _usable(c, draft)]
    torques = [c for c in alive if c.quantity == "torque" and stated_unit(c) not in CURRENT_UNITS]
    currents = [c for c in alive if c.quantity == "current" or stated_unit(c) in CURRENT_UNITS]
    plain = []
    for column in torques:
        name, why = _named(column)
        if name:
            _add(draft, name, column, why)
        else:
            plain.append(column)
    known = {name for name in draft.channels if name.endswith("_torque")}
    for column in plain:
        from_current = next((c for c in currents if _share(column, c) > _PROPORTIONAL), None)
        if from_current is not None and "motor_torque" not in known:
            _add(draft, "motor_torque", column, f"goes with the current {from_current.label}")
        elif known:
            draft.unused[column.label] = f"beside {', '.join(sorted(known))} nothing says which torque it is"
        else:
            channel = Channel(
                column, {"unit": _unit(column)}, "a torque of the motor, or at the output?", Ground.OPEN
            )
            draft.channels["output_torque"] = channel
            draft.ask(
                f"the channel of {column.label}: motor_torque, output_torque (of the drive) or load_torque",
                f"{column.label}.channel",
                "motor_torque",
            )
    _currents(currents, draft)
    _sides(currents, ratio, draft)


def _usable(column: Candidate, draft: Draft) -> bool:
    if moves(column.values):
        return True
    draft.unused[column.label] = "all its numbers are the same"
    return False


def _named(column: Candidate) -> tuple[str, str]:
    """Channel that a torque's name or the user says, and why."""
    if "channel" in column.said:
        return column.said["channel"], "you say so"
    said, marks = column.meaning.side, column.meaning.marks
    if "current" in marks:
        return "motor_torque", "by its name: from the motor's current"
    if said == "motor":
        return "motor_torque", "by its name"
    if said == "load" and "sensor" not in marks:
        return "load_torque", "by its name"
    if said in ("output", "load") or "sensor" in marks:
        return "output_torque", "by its name"
    return "", ""


def _add(draft: Draft, name: str, column: Candidate, why: str) -> None:
    if name in draft.channels:
        draft.unused[column.label] = f"{draft.channels[name].source.label} is {name} already"
        return
    draft.channels[name] = Channel(column, {"unit": _unit(column)}, why)


def _unit(column: Candidate) -> Answer:
    stated = stated_unit(column)
    if stated in TORQUE_UNITS:
        said = "unit" in column.said
        return Answer(
            stated, Ground.SAID if said else Ground.STATED, "" if said else f"the file says {stated}"
        )
    return Answer("N m", Ground.ASSUMED, "no unit is stated")


def _share(y: Candidate, x: Candidate) -> float:
    found = slope(y.values, x.values)
    return found.explained if found is not None else 0.0


def _currents(currents: list[Candidate], draft: Draft) -> None:
    """A current stands for the motor's torque where no torque does."""
    for column in currents:
        if column.meaning.marks & {"d"}:
            draft.unused[column.label] = "the direct axis makes no torque"
            continue
        motor = draft.channels.get("motor_torque")
        if motor is not None:
            found = slope(motor.source.values, column.values)
            if found is not None and found.explained > _PROPORTIONAL:
                exact = found.explained > _EXACT
                words = f"{motor.source.label} is {found.factor:.4g} N m/A times it" if exact else (
                    f"{motor.source.label} is about {found.factor:.3g} N m/A times it")  # fmt: skip
                draft.unused[column.label] = words
            else:
                draft.unused[column.label] = f"{motor.source.label} is the motor's torque already"
            continue
        stated = stated_unit(column)
        constant = column.said.get("torque_constant_nm_per_a")
        keys = {
            "unit": Answer(
                stated or "A", Ground.STATED if stated else Ground.ASSUMED, "" if stated else "a current"
            ),
            "torque_constant_nm_per_a": Answer(float(constant), Ground.SAID)
            if constant
            else Answer(None, Ground.OPEN, "torque of one ampere"),
        }
        draft.channels["motor_torque"] = Channel(column, keys, "the motor's current")
        if not constant:
            draft.ask(
                f"the torque constant of {column.label} in N m/A{_hint(column, draft)}",
                f"{column.label}.torque_constant_nm_per_a",
                "0.1",
            )


def _hint(column: Candidate, draft: Draft) -> str:
    sensor = draft.channels.get("output_torque")
    found = slope(sensor.source.values, column.values) if sensor is not None else None
    if sensor is None or found is None or found.explained < 0.5:
        return ""
    rise = f"{abs(found.factor):.2g} of its units"
    return f" ({sensor.source.label} rises by about {rise} with one of the current's)"


def _sides(currents: list[Candidate], ratio: float | None, draft: Draft) -> None:
    """To which side the motor's torque refers."""
    motor = draft.channels.get("motor_torque")
    if motor is None:
        return
    side = _side(motor, currents, ratio, draft)
    if side is not None:
        motor.keys["side"] = side
    _direction(motor, ratio, draft)
    at_output = []
    for name, channel in draft.channels.items():
        unit = channel.keys["unit"].value
        if not name.endswith("torque") or unit not in TORQUE_UNITS:
            continue
        refers = channel.keys.get("side")
        largest = float(np.nanquantile(np.abs(channel.source.values), 0.999)) * TORQUE_UNITS[unit]
        if name != "motor_torque" or (refers is not None and refers.value == "output"):
            at_output.append(largest)
        elif ratio is not None:
            at_output.append(largest * abs(ratio))
    draft.peak_output_nm = max(at_output, default=None)


def _direction(motor: Channel, ratio: float | None, draft: Draft) -> None:
    """Ask which one counts the other way, where the two torques do.

    The power is the same on both sides: T_output = ratio T_motor, or both are equal where told at the output.
    """
    output = draft.channels.get("output_torque")
    if output is None or {"sign"} & {*motor.source.said, *output.source.said}:
        return
    side = motor.keys.get("side")
    at_output = side is not None and side.value == "output"
    if not at_output and ratio is None:
        return
    found = slope(output.source.values, motor.source.values)
    along = 1.0 if at_output or ratio is None else ratio
    if found is not None and found.explained > _PROPORTIONAL and found.factor * along < 0:
        why = f"it falls where {motor.source.label} rises"
        output.keys["sign"] = Answer(None, Ground.OPEN, why)
        draft.ask(
            f"the sign of {output.source.label}: {why}, and the drive's torque on the output does not "
            f"(or give the other's)",
            f"{output.source.label}.sign",
            "-1",
        )


def _side(motor: Channel, currents: list[Candidate], ratio: float | None, draft: Draft) -> Answer | None:
    said = motor.source.said.get("side")
    if said:
        return Answer(said, Ground.SAID)
    unit = motor.keys["unit"].value
    if unit not in TORQUE_UNITS:
        constant = motor.keys["torque_constant_nm_per_a"].value
        if constant is not None and constant > LARGEST_CONSTANT:
            return Answer(
                "output", Ground.ASSUMED, f"{constant:.3g} N m/A is too much at a motor's own shaft"
            )
        return None
    scale = TORQUE_UNITS[unit]
    output = draft.channels.get("output_torque")
    if output is not None and output.keys["unit"].value in TORQUE_UNITS:
        found = slope(motor.source.values, output.source.values)
        if found is not None and found.explained > 0.5:
            quotient = abs(found.factor) * scale / TORQUE_UNITS[output.keys["unit"].value]
            if 1 / _SAME < quotient < _SAME:
                return Answer("output", Ground.SHOWN, f"it is {quotient:.2f} times {output.source.label}")
            if ratio is not None and 1 / _SAME < quotient * abs(ratio) < _SAME:
                return Answer("motor", Ground.SHOWN, f"it is 1/{1 / quotient:.0f} of {output.source.label}")
    for current in currents:
        found = slope(motor.source.values, current.values)
        if found is not None and found.explained > _PROPORTIONAL:
            constant = abs(found.factor) * scale / CURRENT_UNITS.get(stated_unit(current), 1.0)
            if constant > LARGEST_CONSTANT:
                why = f"{constant:.3g} N m/A of {current.label} is too much at a motor's own shaft"
                return Answer("output", Ground.ASSUMED, why)
            return Answer(
                "motor", Ground.ASSUMED, f"{constant:.3g} N m/A of {current.label} is a motor's own"
            )
    largest = float(np.nanquantile(np.abs(motor.source.values), 0.999)) * scale
    if largest > LARGEST_MOTOR:
        return Answer("output", Ground.ASSUMED, f"{largest:.0f} N m is too much at a motor's own shaft")
    if motor.source.meaning.side == "motor":
        return None
    return Answer("motor", Ground.ASSUMED, f"its largest, {largest:.3g} N m, can be a motor's own")
