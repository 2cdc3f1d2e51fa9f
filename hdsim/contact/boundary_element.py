"""A second opinion on the contact law: a fractal surface pressed on a half-space by boundary elements.

The asperity model adds up asperities that don't know of each other. Here a whole rough surface is solved with
tamaas (Frérot et al. (2020), J. Open Source Software 5:2121; optional), periodic and elastic, after Polonsky
and Keer (1999), Wear 231:206. Without yield the peak pressures exceed the hardness, so the curve is an upper
bound of the stiffness at small loads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdsim.contact.measured import TableLaw
from hdsim.errors import InputError
from hdsim.surface.flank import Flank, structure_function

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PressedSurface:
    """Contact of a rough square over load.

    Args:
        mean_pressure_pa: shape (n,), rising, Pa.
        approach_m: mean gap at first touch minus mean gap, shape (n,), m.
        contact_fraction: share of the area in contact, shape (n,).
    """

    mean_pressure_pa: Array
    approach_m: Array
    contact_fraction: Array

    def law(self, nominal_area_m2: float) -> TableLaw:
        """The curve as a contact law of a flank of this area."""
        return TableLaw(
            np.concatenate([[0.0], self.approach_m]),
            np.concatenate([[0.0], self.mean_pressure_pa * nominal_area_m2]),
        )

    def write_csv(self, path: str | Path, nominal_area_m2: float) -> None:
        """Write the file that ``law: table`` of a scenario reads."""
        lines = ["penetration_m,force_n", "0,0"]
        forces = self.mean_pressure_pa * nominal_area_m2
        lines += [f"{f:.9e},{F:.9e}" for f, F in zip(self.approach_m, forces, strict=True)]
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def isotropic_surface(flank: Flank, nodes: int, side_m: float, seed: int | list[int]) -> Array:
    """Heights of a periodic isotropic Gaussian surface whose profiles have the flank's structure function.

    The spectrum is the self-affine one, amplitude q^-(1 + H) with H = 3 - D, up to the grid's; the level is
    set so that the mean square height difference over eight steps is Eq. 17's (corrected constant).

    Args:
        flank: the surface.
        nodes: grid points along a side.
        side_m: length of a side, m.
        seed: seed of the phases.

    Returns:
        Shape (nodes, nodes), mean zero, m.
    """
    wave = np.fft.fftfreq(nodes)
    q = np.hypot(wave[:, None], np.fft.rfftfreq(nodes)[None, :])
    amplitude = np.where(q > 0.0, np.where(q > 0.0, q, 1.0) ** -(4.0 - flank.D), 0.0)
    white = np.random.default_rng(seed).standard_normal((nodes, nodes))
    z = np.fft.irfft2(amplitude * np.fft.rfft2(white), s=(nodes, nodes))
    steps = 8
    found = np.mean([np.mean((np.roll(z, steps, axis) - z) ** 2) for axis in (0, 1)])
    wanted = float(structure_function(steps * side_m / nodes, flank))
    return np.asarray((z - z.mean()) * math.sqrt(wanted / found))


def press(
    heights_m: Array,
    side_m: float,
    reduced_modulus_pa: float,
    mean_pressure_pa: ArrayLike,
    *,
    tolerance: float = 1e-7,
) -> PressedSurface:
    """Press a periodic rough surface on a smooth half-space.

    Args:
        heights_m: shape (n, n), m.
        side_m: length of a side, m.
        reduced_modulus_pa: E of Hertz, Pa.
        mean_pressure_pa: loads over nominal area, rising, Pa.
        tolerance: relative error of the solver.

    Raises:
        InputError: when tamaas is not installed, or doesn't converge.
    """
    from importlib import import_module

    try:
        tamaas: Any = import_module("tamaas")
    except ImportError:
        raise InputError("boundary elements need the package tamaas (pip install 'hdsim[bem]')") from None
    tamaas.set_log_level(tamaas.LogLevel.error)
    z = np.ascontiguousarray(heights_m - heights_m.mean())
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [side_m, side_m], list(z.shape))
    model.E, model.nu = reduced_modulus_pa, 0.0
    solver = tamaas.PolonskyKeerRey(model, z, tolerance)
    solver.max_iter = 5000
    pressures = np.atleast_1d(np.asarray(mean_pressure_pa, dtype=float))
    approach, fraction = np.empty_like(pressures), np.empty_like(pressures)
    for i, pressure in enumerate(pressures):
        error = solver.solve(pressure)
        if not error < 100.0 * tolerance:
            raise InputError(f"boundary elements did not converge at {pressure:.3g} Pa (error {error:.1e})")
        touching = np.asarray(model.traction) > 0.0
        gap = np.asarray(model.displacement) - z
        # The solver's displacement has an arbitrary level: the gap is zero where the surfaces touch.
        approach[i] = z.max() - (gap.mean() - gap[touching].mean())
        fraction[i] = touching.mean()
    return PressedSurface(pressures, approach, fraction)
