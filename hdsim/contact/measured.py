"""A contact law given as points: measured, or computed elsewhere (finite or boundary elements)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hdsim.contact.law import Array, ContactLaw
from hdsim.errors import InputError

#: Columns that a table file must have.
COLUMNS = ("penetration_m", "force_n")


class TableLaw(ContactLaw):
    """Force over penetration through given points, by monotone cubic interpolation.

    The interpolant is PCHIP (Fritsch and Butland (1984), SIAM J. Sci. Stat. Comput. 5:300): it passes through
    every point, its slope is continuous and it rises wherever the points do. Beyond the last point the force
    goes on along the end's tangent (along the last chord where the tangent is flat).

    Args:
        penetration_m: penetrations, shape (n,), n >= 3, strictly increasing from 0, m.
        force_n: forces, shape (n,), strictly increasing from 0, N.
    """

    def __init__(self, penetration_m: ArrayLike, force_n: ArrayLike) -> None:
        from scipy.interpolate import PchipInterpolator

        f, force = np.asarray(penetration_m, dtype=float), np.asarray(force_n, dtype=float)
        _check(f, force)
        self.penetration_m, self.force_n = f, force
        self._spline = PchipInterpolator(f, force, extrapolate=False)
        self._slope = self._spline.derivative()
        self._integral = self._spline.antiderivative()
        end = float(self._slope(f[-1]))
        self._end_stiffness = end if end > 0.0 else float((force[-1] - force[-2]) / (f[-1] - f[-2]))

    @classmethod
    def from_csv(cls, path: str | Path) -> TableLaw:
        """Read a CSV file with a header that names ``penetration_m`` and ``force_n`` (others are ignored).

        Raises:
            InputError: with file and line, when a column or a number is missing or out of order.
        """
        path = Path(path)
        try:
            with path.open(newline="", encoding="utf-8-sig") as file:
                lines = list(file)
                kept = [number for number, line in enumerate(lines, 1) if not line.startswith("#")]
                reader = csv.DictReader(lines[number - 1] for number in kept)
                names = [name.strip() for name in reader.fieldnames or []]
                missing = [name for name in COLUMNS if name not in names]
                if missing:
                    raise InputError(
                        f"{path}: found columns {', '.join(names) or 'none'}, expected {', '.join(COLUMNS)}"
                    )
                reader.fieldnames = names
                rows = [(kept[reader.line_num - 1], row) for row in reader]
        except OSError as error:
            raise InputError(f"{path}: cannot read the contact table: {error.strerror}") from error
        except (UnicodeDecodeError, csv.Error) as error:
            raise InputError(f"{path}: not a CSV text file: {error}") from error
        points = []
        for line, row in rows:
            try:
                points.append([float(row[name]) for name in COLUMNS])
            except (TypeError, ValueError):
                found = ", ".join(repr(row[name]) for name in COLUMNS)
                raise InputError(f"{path}:{line}: expected two numbers, found {found}") from None
        try:
            return cls(*np.array(points, dtype=float).reshape(-1, 2).T)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @property
    def initial_stiffness_n_per_m(self) -> float:
        """Slope at the first point, N/m."""
        return float(self._slope(0.0))

    def _force(self, penetration: Array) -> Array:
        end = self.penetration_m[-1]
        inside = self._spline(np.minimum(penetration, end))
        return np.asarray(inside + np.maximum(penetration - end, 0.0) * self._end_stiffness)

    def _penetration(self, force: Array) -> Array:
        from scipy.optimize.elementwise import find_root

        cell = np.clip(np.searchsorted(self.force_n, force) - 1, 0, len(self.force_n) - 2)
        target = np.minimum(force, self.force_n[-1])
        bracket = (self.penetration_m[cell], self.penetration_m[cell + 1])
        inside = find_root(lambda f, F: self._spline(f) - F, bracket, args=(target,)).x
        return np.asarray(inside + np.maximum(force - self.force_n[-1], 0.0) / self._end_stiffness)

    def _stiffness(self, force: Array) -> Array:
        slope = self._slope(np.minimum(self._penetration(force), self.penetration_m[-1]))
        return np.where(force > self.force_n[-1], self._end_stiffness, slope)

    def _energy(self, force: Array) -> Array:
        inside = self._integral(np.minimum(self._penetration(force), self.penetration_m[-1]))
        over = np.maximum(force**2 - self.force_n[-1] ** 2, 0.0)
        return np.asarray(inside + over / (2.0 * self._end_stiffness))


def _check(f: Array, force: Array) -> None:
    """Refuse points that are no contact law."""
    if f.ndim != 1 or f.shape != force.shape:
        raise InputError(
            f"a contact table needs two lists of one length, found shapes {f.shape} and {force.shape}"
        )
    if len(f) < 3:
        raise InputError(f"a contact table needs at least 3 points, found {len(f)}")
    if not (np.isfinite(f).all() and np.isfinite(force).all()):
        raise InputError("a contact table must hold finite numbers only")
    if f[0] != 0.0 or force[0] != 0.0:
        raise InputError(f"a contact table must start at (0 m, 0 N), found ({f[0]:g} m, {force[0]:g} N)")
    for name, values in (("penetration", f), ("force", force)):
        wrong = np.flatnonzero(np.diff(values) <= 0.0)
        if len(wrong):
            i = int(wrong[0])
            raise InputError(
                f"{name} must rise strictly: point {i + 2} has {values[i + 1]:g} after {values[i]:g}"
            )
