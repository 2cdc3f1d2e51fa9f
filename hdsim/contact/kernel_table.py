"""A contact law as a table of polynomials that a compiled kernel can evaluate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hdsim.contact.law import Array, ContactLaw
from hdsim.errors import InputError


@dataclass(frozen=True)
class ContactTable:
    """Piecewise cubic force over a uniform grid of penetrations that starts at 0.

    With s = f - k * step_m in cell k = floor(f / step_m), and c = coefficients[k],

        F = c0 + c1 s + c2 s^2 + c3 s^3,    U = c4 + c0 s + c1 s^2/2 + c2 s^3/3 + c3 s^4/4

    so that dU/df is F exactly. F and its slope are exact at every node: F is continuously differentiable.
    Beyond the last node F goes on along its tangent; for f <= 0 everything is zero.

    Args:
        step_m: width of a cell, m.
        coefficients: shape (nodes - 1, 5), C-contiguous.
        end_force_n: force at the last node, N.
        end_stiffness_n_per_m: slope at the last node, N/m.
        end_energy_j: energy at the last node, J.
        relative_force_error: largest |F_table - F_law| / max(F_law, 1 % of the end's force), measured at
            seven points in every cell; NaN when it was not measured.
        relative_energy_error: the same for the energy.
    """

    step_m: float
    coefficients: Array
    end_force_n: float
    end_stiffness_n_per_m: float
    end_energy_j: float
    relative_force_error: float
    relative_energy_error: float

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.coefficients)

    @property
    def end_m(self) -> float:
        """Penetration of the last node, m."""
        return self.step_m * self.count

    def _locate(self, penetration_m: ArrayLike) -> tuple[Array, Array, Array]:
        """Coefficients (5, ...), distance from the cell's start, and how far beyond the end."""
        f = np.maximum(np.asarray(penetration_m, dtype=float), 0.0)
        inside = np.minimum(f, self.end_m)
        cell = np.minimum((inside / self.step_m).astype(int), self.count - 1)
        return np.moveaxis(self.coefficients[cell], -1, 0), inside - cell * self.step_m, f - inside

    def force(self, penetration_m: ArrayLike) -> Array:
        """Force, N."""
        c, s, over = self._locate(penetration_m)
        return np.asarray(c[0] + s * (c[1] + s * (c[2] + s * c[3])) + over * self.end_stiffness_n_per_m)

    def stiffness(self, penetration_m: ArrayLike) -> Array:
        """dF/df, N/m."""
        c, s, over = self._locate(penetration_m)
        slope = np.where(over > 0.0, self.end_stiffness_n_per_m, c[1] + s * (2.0 * c[2] + 3.0 * s * c[3]))
        return np.where(np.asarray(penetration_m) > 0.0, slope, 0.0)

    def energy(self, penetration_m: ArrayLike) -> Array:
        """Stored energy, J."""
        c, s, over = self._locate(penetration_m)
        inside = c[4] + s * (c[0] + s * (c[1] / 2.0 + s * (c[2] / 3.0 + s * c[3] / 4.0)))
        return np.asarray(inside + over * (self.end_force_n + 0.5 * over * self.end_stiffness_n_per_m))


def tabulate(
    law: ContactLaw, maximum_force_n: float, nodes: int = 1024, *, measure_error: bool = True
) -> ContactTable:
    """Tabulate a law from zero to a force.

    Args:
        law: the law.
        maximum_force_n: force at the last node, N.
        nodes: number of nodes, at least 3.
        measure_error: evaluate the law between the nodes too, which takes three quarters of the time.

    Returns:
        The table, with its error against the law if that was measured.
    """
    if not maximum_force_n > 0.0 or nodes < 3:
        raise InputError(
            f"a contact table needs a positive force and 3 nodes, found {maximum_force_n} N, {nodes}"
        )
    step = float(law.penetration(maximum_force_n)) / (nodes - 1)
    grid = step * np.arange(nodes)
    force = law.force(grid)
    slope = law.stiffness_at_force(force)
    slope[0] = law.initial_stiffness_n_per_m
    c, end_energy = quartic_cells(step, force, slope)
    ends = float(force[-1]), float(slope[-1]), end_energy
    table = ContactTable(step, c, *ends, math.nan, math.nan)
    if not measure_error:
        return table
    inside = (grid[:-1, None] + step * np.arange(1, 8) / 8.0).ravel()
    exact_force = law.force(inside)
    exact_energy = law.energy_at_force(exact_force)
    return ContactTable(
        step,
        c,
        *ends,
        _relative(table.force(inside), exact_force),
        _relative(table.energy(inside), exact_energy),
    )


def quartic_cells(step: float, force: Array, stiffness: Array) -> tuple[Array, float]:
    """Cubic Hermite cells of a force whose integral is the energy, so that energy and force agree exactly.

    Args:
        step: width of a cell.
        force: values at the nodes, shape (n + 1,).
        stiffness: slopes at the nodes, shape (n + 1,).

    Returns:
        The coefficients c of ``ContactTable``, shape (n, 5), and the energy at the last node.
    """
    rise = np.diff(force)
    c = np.empty((len(rise), 5))
    c[:, 0], c[:, 1] = force[:-1], stiffness[:-1]
    c[:, 2] = (3.0 * rise / step - 2.0 * stiffness[:-1] - stiffness[1:]) / step
    c[:, 3] = (stiffness[:-1] + stiffness[1:] - 2.0 * rise / step) / step**2
    work = step * (c[:, 0] + step * (c[:, 1] / 2.0 + step * (c[:, 2] / 3.0 + step * c[:, 3] / 4.0)))
    energy = np.concatenate([[0.0], np.cumsum(work)])
    c[:, 4] = energy[:-1]
    return c, float(energy[-1])


def _relative(found: Array, exact: Array) -> float:
    return float(np.max(np.abs(found - exact) / np.maximum(exact, 0.01 * exact[-1])))
