"""The potential of a drive's teeth as a table over displacement and angle, kept for the next model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import _mesh_layout as place
from hdsim.drive import _teeth, _teeth_table

Array = NDArray[np.float64]

#: Points between the nodes at which the error is measured.
_TRIED = 2000


@dataclass(frozen=True)
class PotentialTable:
    """A bicubic spline of the potential.

    Attributes:
        start_m: first displacement.
        step_m: between two displacements.
        coefficients: of the uniform B-splines, J, shape (displacements + 2, angles over half a turn);
            read-only.
        force_error_n: largest error of the force found at points between the nodes.
    """

    start_m: float
    step_m: float
    coefficients: Array
    force_error_n: float


def potential_table(numbers: Array, reach_m: float, twist_nodes: int, angle_nodes: int) -> PotentialTable:
    """Table of the potential, the same one for the same teeth: it costs as much as several predictions.

    Args:
        numbers: those of a compiled mesh, as far as its teeth: header, contact, gaps, pitch errors.
        reach_m: largest displacement either way, m.
        twist_nodes: displacements.
        angle_nodes: angles over half a turn of the wave generator.
    """
    return _kept(numbers.tobytes(), reach_m, twist_nodes, angle_nodes)


@lru_cache(maxsize=8)
def _kept(content: bytes, reach_m: float, twist_nodes: int, angle_nodes: int) -> PotentialTable:
    from scipy.interpolate import make_interp_spline

    exact = np.frombuffer(content).copy()
    x = np.linspace(-reach_m, reach_m, twist_nodes)
    step = x[1] - x[0]
    angles = np.arange(angle_nodes) * np.pi / angle_nodes
    values = np.array([_teeth.potentials(exact, xi, angles)[:, 0] for xi in x])
    ends = np.array([_teeth.potentials(exact, xi, angles)[:, 1] for xi in (x[0], x[-1])])
    # Uniform B-spline coefficients: periodic in the angle, the exact force at both ends of x.
    turns = 2 * np.pi * np.arange(angle_nodes // 2 + 1) / angle_nodes

    def over_angle(samples: Array) -> Array:
        spectrum = np.fft.rfft(samples, axis=1) / ((2 + np.cos(turns)) / 3)
        return np.asarray(np.fft.irfft(spectrum, n=angle_nodes, axis=1))

    knots = np.concatenate([x[0] + step * np.arange(-3, 0), x, x[-1] + step * np.arange(1, 4)])
    forces = over_angle(ends)
    curve = make_interp_spline(
        x, over_angle(values), k=3, t=knots, bc_type=([(1, forces[0])], [(1, forces[1])])
    )
    coefficients = np.ascontiguousarray(curve.c)
    coefficients.setflags(write=False)
    header = np.zeros(place.HEADER)
    header[place.TABLE_TWIST_STEP], header[place.TABLE_TWIST_START] = step, x[0]
    header[place.TABLE_TWIST_NODES], header[place.TABLE_ANGLE_NODES] = coefficients.shape
    header[place.TABLE_AT] = len(header)
    table = np.concatenate([header, coefficients.ravel()])
    rng = np.random.default_rng(0)
    points = np.stack([rng.uniform(-reach_m, reach_m, _TRIED), rng.uniform(0, np.pi, _TRIED)], axis=1)
    errors = [
        abs(_teeth_table.table_potential(table, xi, a)[1] - _teeth.teeth_potential(exact, xi, a)[1])
        for xi, a in points
    ]
    return PotentialTable(float(x[0]), float(step), coefficients, float(max(errors)))
