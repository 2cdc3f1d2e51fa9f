"""Recorded signals: a CSV file becomes cubic pieces."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.actuation import _signal_kernel as law
from hdsim.actuation.signal_data import Move, Segment, hold
from hdsim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence


def read_columns(file: Path, columns: Sequence[str]) -> list[list[float]]:
    """Read columns of numbers from a CSV file with a header line.

    Args:
        file: UTF-8 text, comma-separated; lines that begin with ``#`` and empty lines are skipped.
        columns: header names; the first is time and must increase strictly.

    Returns:
        One list of numbers per column, all of the same length, at least 2.

    Raises:
        InputError: with file and line, when anything is not as described.
    """
    import math

    try:
        text = file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise InputError(f"{file}: expected UTF-8 text, found binary data") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.startswith("#")
    ]
    if not lines:
        raise InputError(f"{file}: empty; expected a header line and rows of numbers")
    head, header = lines[0][0], [name.strip() for name in next(csv.reader([lines[0][1]]))]
    for name in columns:
        if header.count(name) != 1:
            found = "twice" if name in header else "not"
            raise InputError(f"{file}:{head}: column {name!r} is {found} there; found: {', '.join(header)}")
    places = [header.index(name) for name in columns]
    result: list[list[float]] = [[] for _ in columns]
    for number, line in lines[1:]:
        row = next(csv.reader([line]))
        for name, place, values in zip(columns, places, result, strict=True):
            if place >= len(row):
                raise InputError(f"{file}:{number}: {len(row)} fields, expected {len(header)}")
            try:
                value = float(row[place])
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise InputError(f"{file}:{number}: {name}: found {row[place]!r}, expected a finite number")
            values.append(value)
        times = result[0]
        if len(times) > 1 and times[-1] <= times[-2]:
            raise InputError(
                f"{file}:{number}: {columns[0]}: found {times[-1]:g} after {times[-2]:g}, "
                "expected a later time"
            )
    if len(result[0]) < 2:
        raise InputError(f"{file}: expected at least two rows of numbers, found {len(result[0])}")
    return result


def interpolated(file: Path, time_column: str, value_column: str, interpolation: str, factor: float) -> Move:
    """The recorded signal as a move; a recording that begins before time 0 is cut there.

    Args:
        file: CSV file.
        time_column: header of the times, s.
        value_column: header of the values.
        interpolation: ``linear``, ``pchip`` (Fritsch and Carlson 1980) or ``spline`` (not-a-knot).
        factor: from the file's unit to SI.

    Raises:
        InputError: with file and line, when the file is not as described.
    """
    import numpy as np

    times, values = (np.array(column) for column in read_columns(file, [time_column, value_column]))
    values = factor * values
    if interpolation == "linear":
        rows = np.zeros((len(times) - 1, 4))
        rows[:, 0] = values[:-1]
        rows[:, 1] = np.diff(values) / np.diff(times)
    else:
        from scipy.interpolate import CubicSpline, PchipInterpolator

        kind = PchipInterpolator if interpolation == "pchip" else CubicSpline
        rows = np.ascontiguousarray(kind(times, values).c[::-1].T)
        # Short data gives a polynomial of lower degree.
        rows = np.hstack([rows, np.zeros((len(rows), 4 - rows.shape[1]))])
    segment = Segment(law.CUBIC, times[:-1].tolist(), [tuple(row) for row in rows.tolist()])
    end, final = float(times[-1]), float(values[-1])
    return Move((segment, hold(end, final)), end, float(values[0]), final)
