"""The torsion chain: the catalogue's wind-up, the share that the mesh already has, the rest as a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.contact.kernel_table import quartic_cells
from hdsim.errors import PhysicsError

if TYPE_CHECKING:
    from hdsim.drive.parameters import Torsion

Array = NDArray[np.float64]

#: Torque up to which the torsion table reaches, as a multiple of the rated torque; linear beyond.
TABLE_REACH = 4.0
CELLS = 2048
#: Torque to both sides of a corner within which its slopes are taken, as a share of the table's reach.
_BESIDE = 1e-6


def catalogue_wind_up(torsion: Torsion, torque: Array) -> Array:
    """Twist (rad) of the output over torque (N m), input locked: three straight segments, odd.

    phi = T/K1 up to T1, then 1/K2 and from T2 on 1/K3 (the catalogue's definition); each corner may be
    rounded over +- ``corner_smoothing_nm``.
    """
    size = np.abs(torque)
    c1, c2, c3 = (
        1 / torsion.stiffness_k1_nm_per_rad,
        1 / torsion.stiffness_k2_nm_per_rad,
        1 / torsion.stiffness_k3_nm_per_rad,
    )
    width = torsion.corner_smoothing_nm
    twist = c1 * size
    for corner, change in ((torsion.torque_t1_nm, c2 - c1), (torsion.torque_t2_nm, c3 - c2)):
        past = size - corner
        ramp = np.maximum(past, 0.0)
        if width > 0:
            ramp = np.where(np.abs(past) < width, (past + width) ** 2 / (4 * width), ramp)
            # Without this the rounded corner would leave a twist at zero torque.
            at_zero = max(0.0, width - corner) ** 2 / (4 * width)
            ramp = ramp - at_zero
        twist = twist + change * ramp
    return np.sign(torque) * twist


@lru_cache(maxsize=32)
def catalogue_numbers(
    torsion: Torsion, beside: tuple[Callable[[Array], Array], ...], largest_torque_nm: float
) -> tuple[float, Array]:
    """Torque over twist of the catalogue's wind-up and others beside it, see ``spring_numbers``; read-only.

    Kept for the next model: a fit makes hundreds that differ in other numbers.
    """
    corners = [torsion.torque_t1_nm, torsion.torque_t2_nm]
    step, numbers = spring_numbers([partial(catalogue_wind_up, torsion), *beside], corners, largest_torque_nm)
    numbers.setflags(write=False)
    return step, numbers


def structure_wind_up(
    torsion: Torsion, rated_torque_nm: float, mesh_wind_up: Callable[[float], float]
) -> Callable[[Array], Array]:
    """Wind-up of cup and wave-generator bearing: what the catalogue's total leaves beside the mesh.

    The catalogue gives secants between 0, T1, T2 and the rated torque T_N, and the total must have them:
    on each segment the structure's compliance is the catalogue's less the mesh's secant compliance.

    Args:
        torsion: the catalogue's segments.
        rated_torque_nm: end of the third segment.
        mesh_wind_up: twist (rad, at the output) of the mesh at a torque (N m), gap included.

    Raises:
        PhysicsError: the mesh alone is softer than the catalogue's whole drive on a segment.
    """
    corners = [0.0, torsion.torque_t1_nm, torsion.torque_t2_nm]
    corners.append(max(rated_torque_nm, 1.2 * torsion.torque_t2_nm))
    total = catalogue_wind_up(torsion, np.array(corners))
    mesh = np.array([0.0] + [mesh_wind_up(torque) for torque in corners[1:]])
    compliance = np.diff(total - mesh) / np.diff(corners)
    for k, value in enumerate(compliance):
        if value <= 0:
            raise PhysicsError(
                f"the mesh alone winds up {np.diff(mesh)[k]:.3g} rad between {corners[k]:.3g} and "
                f"{corners[k + 1]:.3g} N m, the catalogue's whole drive only {np.diff(total)[k]:.3g} rad "
                f"(stiffness_k{k + 1}_nm_per_rad): lower the gap, or raise contact or torsional stiffness"
            )
    inner = np.concatenate([[0.0], np.cumsum(compliance * np.diff(corners))])

    def wind_up(torque: Array) -> Array:
        size = np.abs(torque)
        twist = np.interp(size, corners, inner) + np.maximum(size - corners[-1], 0.0) * compliance[-1]
        return np.asarray(np.sign(torque) * twist)

    return wind_up


def spring_numbers(
    wind_ups: Sequence[Callable[[Array], Array]],
    corners_nm: Sequence[float],
    largest_torque_nm: float,
    *,
    scale: float = 1.0,
) -> tuple[float, Array]:
    """Torque over twist of springs in series, for the compiled mesh: corners, and the rest as a table.

    With s_k by how much the spring is stiffer beyond its corner at the twist x_k,

        T(x) = R(x) + sum_k s_k max(x - x_k, 0),

    R has no corner and is what the table holds (three straight segments: exactly). A corner within a cell of
    a table would be rounded over it, otherwise at every place, and so would what moves it: of dT/dK1, which
    is x before the first corner and K2 T1 / K1^2 beyond, a table of T is off by 40 % within that cell.

    Args:
        wind_ups: odd, increasing functions from torque (N m) to twist (rad), both at the output.
        corners_nm: torques where a wind-up has a corner, up to ``_quartic.CORNERS``.
        largest_torque_nm: end of the table.
        scale: |g| of the arrangement: twist at the ring is scale times, torque 1/scale times the output's.

    Returns:
        Cell width (rad), and numbers of shape (2 CORNERS + 5 CELLS,): twist (rad) and rise of the stiffness
        (N m/rad) of each corner, and cells, see ``hdsim.contact.kernel_table``.

    Raises:
        PhysicsError: the total wind-up does not increase with torque.
    """
    from scipy.interpolate import PchipInterpolator

    from hdsim.drive._quartic import CORNERS

    def total(torque: Array) -> Array:
        return np.asarray(scale * np.sum([wind_up(torque) for wind_up in wind_ups], axis=0))

    # Denser towards zero, where a play is taken up.
    near = np.geomspace(1e-6, 1e-1, 400) * largest_torque_nm
    even = np.linspace(0.0, largest_torque_nm, 4001)
    torque = np.unique(np.concatenate([even, near, np.asarray(corners_nm)]))
    apart = np.diff(torque, prepend=-1.0) > 1e-10 * largest_torque_nm
    torque = torque[apart & (torque <= largest_torque_nm)]
    twist = total(torque)
    if np.any(np.diff(twist) <= 0):
        bad = torque[int(np.argmax(np.diff(twist) <= 0))]
        raise PhysicsError(f"the torsion chain's twist must grow with torque; it does not at {bad:.4g} N m")
    corners = np.zeros((CORNERS, 2))
    step = _BESIDE * largest_torque_nm
    inner = np.unique([corner for corner in corners_nm if step < corner < largest_torque_nm - step])
    here = total(inner)
    corners[: len(inner), 0] = here
    corners[: len(inner), 1] = step / scale / (total(inner + step) - here)
    corners[: len(inner), 1] -= step / scale / (here - total(inner - step))
    straightened = torque / scale
    for at, stiffer in corners:
        straightened = straightened - stiffer * np.maximum(twist - at, 0.0)
    curve = PchipInterpolator(twist, straightened)
    width = float(twist[-1]) / CELLS
    nodes = width * np.arange(CELLS + 1)
    nodes[-1] = twist[-1]
    cells, _ = quartic_cells(width, curve(nodes), curve.derivative()(nodes))
    return width, np.concatenate([corners.ravel(), cells.ravel()])
