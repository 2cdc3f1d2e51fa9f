"""The draft of a mapping: the columns of a file, one axis of it, and every key with its ground."""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path

import numpy as np

from hdsim.errors import InputError
from hdsim.log.guess.findings import Answer, Candidate, Channel, Draft, Ground
from hdsim.log.guess.kinematics import map_motion
from hdsim.log.guess.readings import stated_unit
from hdsim.log.guess.relations import moves
from hdsim.log.guess.spikes import propose_masks
from hdsim.log.guess.survey import Survey, survey
from hdsim.log.guess.timing import find_time
from hdsim.log.guess.torque import map_torques
from hdsim.log.mapping import Channels, Form
from hdsim.log.readers.contract import Tell, missing, silent
from hdsim.log.units import TIME_UNITS

#: An axis moves where its travel is at least this share of the farthest one's.
_MOVES = 0.05
#: Samples that are missing where a gap is worth a note.
_GAP = 5
_OF_COLUMN = ("channel", "unit", "side", "sign", "counts_per_turn", "torque_constant_nm_per_a")
_OF_TIME = ("column", "unit", "rate_hz")


def draft(
    path: Path,
    said: dict[str, str] | None = None,
    axis: int | None = None,
    form: Form | None = None,
    tell: Tell = silent,
) -> Draft:
    """Find out what a file holds.

    Args:
        path: the recording.
        said: what the user knows: ``ratio``, ``time.unit``, ``time.rate_hz``, ``time.column``, and
            ``<column>.<key>`` with channel, unit, side, sign, counts_per_turn or torque_constant_nm_per_a.
        axis: number of the axis, of a file with several.
        form: how the file is to be read, as far as the user says.
        tell: hears how far the reading is.

    Raises:
        InputError: the file cannot be read, or what is said does not fit it.
    """
    seen = survey(path, form, tell)
    found = Draft(path.name, list(seen.notes))
    of_time, ratio = _take(seen.columns, dict(said or {}), path)
    time, times = find_time(seen, of_time, found)
    columns, many = _axis(seen, axis, found, path)
    measured = []
    for column in columns:
        if column.said.get("channel") == "none":
            found.unused[column.label] = "you say so"
        elif column.values.dtype.kind == "M" or (
            column.origin.topic is None and column.origin.column == _time_column(found)
        ):
            continue
        elif not column.meaning.measured and "channel" not in column.said:
            found.unused[column.label] = "by its name no measurement"
        else:
            measured.append(column)
    torque = next(
        (c.values for c in measured if c.quantity in ("torque", "current") and moves(c.values)), None
    )
    travels = _travels(seen.columns)
    number = map_motion(measured, travels, time, times, ratio, torque, many, found)
    map_torques([c for c in measured if c.quantity in ("torque", "current")], number, found)
    _temperature(measured, found)
    for channel in found.channels.values():
        if "sign" in channel.source.said:
            channel.keys["sign"] = Answer(int(channel.source.said["sign"]), Ground.SAID)
    _ratio(found, number)
    _gaps(time, found)
    propose_masks(found)
    _leave_out(found)
    return found


def _time_column(found: Draft) -> object:
    answer = found.time.get("column")
    return answer.value if answer is not None else None


def _take(columns: list[Candidate], said: dict[str, str], path: Path) -> tuple[dict[str, str], float | None]:
    """Give every column what is said of it; returns what is said of the time, and the ratio."""
    of_time: dict[str, str] = {}
    ratio = None
    for key, value in said.items():
        place, _, name = key.rpartition(".")
        if key == "ratio":
            ratio = _number(key, value)
            if abs(ratio) < 1:
                raise InputError(
                    f"--set ratio: found {value}, expected motor angle / output angle, at least 1"
                )
        elif place == "time" and name in _OF_TIME:
            of_time[name] = value
            if name == "rate_hz" and _number(key, value) <= 0:
                raise InputError(f"--set {key}: found {value}, expected a rate in Hz")
            if name == "unit" and value not in TIME_UNITS:
                raise InputError(f"--set {key}: found {value!r}, expected {', '.join(TIME_UNITS)}")
        elif name in _OF_COLUMN:
            column = next((c for c in columns if place in (c.label, str(c.origin.column))), None)
            if column is None:
                raise missing(path, "column", place, [c.label for c in columns])
            if name == "channel" and value not in (*Channels.model_fields, "none"):
                raise InputError(
                    f"--set {key}: found {value!r}, expected {', '.join(Channels.model_fields)} or none"
                )
            if name == "side" and value not in ("motor", "output"):
                raise InputError(f"--set {key}: found {value!r}, expected motor or output")
            if name == "sign" and value not in ("1", "-1"):
                raise InputError(f"--set {key}: found {value!r}, expected 1 or -1")
            if name in ("counts_per_turn", "torque_constant_nm_per_a") and _number(key, value) <= 0:
                raise InputError(f"--set {key}: found {value}, expected a positive number")
            column.said[name] = value
        else:
            raise InputError(
                f"--set {key}: expected ratio, time.KEY ({', '.join(_OF_TIME)}) or "
                f"COLUMN.KEY ({', '.join(_OF_COLUMN)})"
            )
    return of_time, ratio


def _number(key: str, text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise InputError(f"--set {key}: found {text!r}, expected a number")
    return found


def _axis(seen: Survey, axis: int | None, found: Draft, path: Path) -> tuple[list[Candidate], bool]:
    """Columns of one axis, with those that belong to none; and whether there are several axes."""
    stems: dict[tuple[str, str], dict[int, Candidate]] = defaultdict(dict)
    for column in seen.columns:
        if column.meaning.axis is not None and column.quantity and column.meaning.measured:
            stems[str(column.origin.topic), column.meaning.stem][column.meaning.axis] = column
    several = [each for each in stems.values() if len(each) > 1]
    numbers = sorted({number for each in several for number in each})
    if len(several) < 2 or len(numbers) < 2:
        if axis is not None:
            raise InputError(f"--axis: found {axis}, but {path} holds one axis, as its columns are named")
        return seen.columns, False
    if axis is None:
        travel: dict[int, float] = dict.fromkeys(numbers, 0.0)
        for each in several:
            sizes = {n: float(np.ptp(c.values)) if moves(c.values) else 0.0
                     for n, c in each.items() if c.quantity in ("angle", "velocity")}  # fmt: skip
            for number, size in sizes.items():
                travel[number] = max(travel[number], size / (max(sizes.values()) or 1.0))
        moving = [number for number in numbers if travel[number] > _MOVES]
        if len(moving) != 1:
            which = ", ".join(map(str, moving or numbers))
            raise InputError(
                f"{path}: it holds the axes {which}: say which one (--axis {(moving or numbers)[0]})"
            )
        axis = moving[0]
        found.notes.append(f"axis {axis} of {len(numbers)}: the only one that moves")
    elif axis not in numbers:
        raise InputError(f"--axis: found {axis}, expected one of {', '.join(map(str, numbers))}")
    else:
        found.notes.append(f"axis {axis} of {len(numbers)}")
    return [c for c in seen.columns if c.meaning.axis in (axis, None) or not _in(c, several)], True


def _in(column: Candidate, several: list[dict[int, Candidate]]) -> bool:
    return column.meaning.axis is not None and (bool(column.quantity) or bool(several))


def _travels(columns: list[Candidate]) -> dict[str, float]:
    """Range of the angles and top speed of the velocities of each stem, over all axes."""
    found: dict[str, float] = {}
    for column in columns:
        if (
            column.quantity in ("angle", "velocity")
            and column.values.dtype.kind == "f"
            and moves(column.values)
        ):
            finite = column.values[np.isfinite(column.values)]
            size = np.ptp(finite) if column.quantity == "angle" else np.quantile(np.abs(finite), 0.99)
            found[column.meaning.stem] = max(found.get(column.meaning.stem, 0.0), float(size))
    return found


def _temperature(measured: list[Candidate], found: Draft) -> None:
    columns = [c for c in measured if c.quantity == "temperature"]
    # The housing's is wanted; a motor's winding is something else.
    columns.sort(
        key=lambda c: ("channel" not in c.said, c.meaning.side == "motor", "housing" not in c.meaning.marks)
    )
    for column in columns:
        if not np.isfinite(column.values).any():
            found.unused[column.label] = "it holds no number"
            continue
        wound = column.meaning.side == "motor" or "winding" in column.meaning.marks
        if "temperature" in found.channels or (wound and "channel" not in column.said):
            found.unused[column.label] = (
                "not the housing's temperature" if wound else "another temperature is mapped"
            )
            continue
        stated = stated_unit(column)
        middle = float(np.nanmedian(column.values))
        if stated:
            unit = Answer(stated, Ground.STATED, f"the file says {column.meaning.unit!r}")
        elif 250 < middle < 420:
            unit = Answer("K", Ground.ASSUMED, f"its median is {middle:.0f}")
        else:
            unit = Answer("degC", Ground.ASSUMED, f"its median is {middle:.0f}")
        found.channels["temperature"] = Channel(column, {"unit": unit}, "by its name")


def _ratio(found: Draft, ratio: float | None) -> None:
    """Ask for the ratio where a channel needs it and nothing tells it."""
    if ratio is not None or found.ratio is not None:
        return
    needing = [
        name
        for name, channel in found.channels.items()
        if (side := channel.keys.get("side")) is not None and not name.startswith(str(side.value))
        and not (side.value == "output" and name in ("load_torque", "temperature"))
    ]  # fmt: skip
    both = {"motor_angle", "output_angle"} <= set(found.channels)
    if needing or both:
        found.ratio = Answer(None, Ground.OPEN, "motor angle / output angle; the file does not tell it")
        why = f"{', '.join(needing)} refers to the other side" if needing else "for the transmission error"
        found.ask(f"the ratio ({why})", "ratio", "100")
        for name in needing:
            found.channels[name].ground = Ground.OPEN
            found.channels[name].why += "; needs the ratio"


def _gaps(time: np.ndarray, found: Draft) -> None:
    """Have gaps of more than a few samples noted by the import."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    unit = found.time.get("unit")
    second = TIME_UNITS.get(str(unit.value), 1.0) if unit is not None else 1.0
    many = int((steps > _GAP * usual).sum())
    if many and usual > 0:
        longest = float(f"{_GAP * usual * second:.3g}")
        found.longest_gap_s = Answer(longest, Ground.SHOWN, f"{many} gaps of more than {_GAP} samples")


def _leave_out(found: Draft) -> None:
    """A channel whose side or unit is open stands as a comment; without any, there is no mapping."""
    if not found.channels:
        found.ask("the channel of each column, as no name tells it", "COLUMN.channel", "output_angle")
