"""Reading profiles and maps of heights: plain text here, instruments' formats through SurfaceTopography."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError

Array = NDArray[np.float64]

#: Metres of the units that a text file may be in.
UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
#: Endings that are read as plain text.
TEXT = (".txt", ".csv", ".dat", ".tsv")


@dataclass(frozen=True)
class MeasuredHeights:
    """Heights as read.

    Args:
        heights_m: shape (profiles, points), along the rows; NaN where the instrument saw nothing, m.
        spacing_m: distance of neighbouring points of a profile, m.
        source: where they come from, for reports.
    """

    heights_m: Array
    spacing_m: float
    source: str


def read_heights(
    path: str | Path, *, spacing_m: float | None = None, unit: str | None = None, columns: bool = False
) -> MeasuredHeights:
    """Read a file of heights.

    Plain text (.txt, .csv, .dat, .tsv) holds numbers separated by blanks, tabs, commas or semicolons;
    comments after ``#`` and lines of words before the first number are skipped. One column is heights, two
    are position and height, more are a map with one profile a line. Every other ending is opened with
    SurfaceTopography, which reads what profilometers write.

    Args:
        path: the file.
        spacing_m: distance of points, m; needed for one column and for maps in text.
        unit: m, mm, um or nm: of a text file's numbers (default um), of an instrument file that names none.
        columns: profiles run down the columns of a map, not along its lines.

    Raises:
        InputError: when the file is no such thing; says what was found.
    """
    path = Path(path)
    if unit is not None and unit not in UNITS:
        raise InputError(f"unit must be one of {', '.join(UNITS)}, found {unit!r}")
    if not path.is_file():
        raise InputError(f"{path}: {'is a directory' if path.is_dir() else 'no such file'}")
    if path.name.lower().endswith(TEXT):
        heights, spacing = _from_text(path, spacing_m, UNITS[unit or "um"])
    else:
        heights, spacing = _from_instrument(path, spacing_m, unit, columns)
        columns = False
    return MeasuredHeights(np.ascontiguousarray(heights.T if columns else heights), spacing, str(path))


def _from_text(path: Path, spacing_m: float | None, scale: float) -> tuple[Array, float]:
    numbers = _numbers(path)
    if numbers.shape[1] == 2:
        x, z = numbers.T * scale
        steps = np.diff(x)
        step = float(np.median(steps))
        if not step > 0.0 or np.abs(steps - step).max() > 0.01 * step:
            worst = int(np.abs(steps - step).argmax())
            raise InputError(
                f"{path}: positions must rise evenly; the step is {step:.6g} m, but {steps[worst]:.6g} m "
                f"after point {worst + 1}"
            )
        return z[None, :], float((x[-1] - x[0]) / (len(x) - 1))
    if spacing_m is None:
        what = "one column of heights" if numbers.shape[1] == 1 else f"a map with {numbers.shape[1]} columns"
        raise InputError(f"{path}: found {what} without positions; the spacing of points must be given")
    return (numbers.T if numbers.shape[1] == 1 else numbers) * scale, spacing_m


def _numbers(path: Path) -> Array:
    """The numbers of a text file, shape (lines, columns)."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file: {error}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            if not rows:
                continue  # names of columns, or an instrument's header
            raise InputError(f"{path}:{number}: expected numbers, found {line.strip()[:60]!r}") from None
        if rows and len(row) != len(rows[0]):
            raise InputError(f"{path}:{number}: expected {len(rows[0])} numbers as before, found {len(row)}")
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: no numbers found")
    return np.array(rows, dtype=float)


def _from_instrument(
    path: Path, spacing_m: float | None, unit: str | None, columns: bool
) -> tuple[Array, float]:
    from importlib import import_module

    try:
        library: Any = import_module("SurfaceTopography")
    except ImportError:
        raise InputError(
            f"{path}: {path.suffix or 'this'} files need the package SurfaceTopography "
            f"(pip install 'hdsim[surface]'); plain text ends in {', '.join(TEXT)}"
        ) from None
    try:
        topography: Any = library.read_topography(str(path), **({"unit": unit} if unit else {}))
    except Exception as error:  # the readers raise whatever their format's parser raises
        raise InputError(f"{path}: SurfaceTopography cannot read it: {error}") from None
    if topography.unit is None:
        raise InputError(f"{path}: the file names no unit; it must be given ({', '.join(UNITS)})")
    topography = topography.to_unit("m")
    if topography.dim == 1:
        positions, z = topography.positions_and_heights()
        spacing = float((positions[-1] - positions[0]) / (len(positions) - 1))
        return np.ma.filled(np.ma.asarray(z, dtype=float), np.nan)[None, :], spacing_m or spacing
    # Heights are indexed (x, y); a profile runs along x unless asked otherwise.
    z = np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan)
    return (z, float(topography.pixel_size[1])) if columns else (z.T, float(topography.pixel_size[0]))
