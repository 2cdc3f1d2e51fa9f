"""What a play means in teeth: a mean half-gap and, by the law of the surfaces, their roughness.

A lumped drive with the play p at its output and the catalogue's wind-up phi(T) turns by phi(T) + p/2 under a
torque T beyond the play. A toothed one with the half-gap b = R |g| p/2 (R the lever of a tooth's normal
force, g the gain of the arrangement) does so too where the play is part of what its springs are calibrated
to: T1/K1' = T1/K1 + p/2, with the other two segments as they are. The half-gap is the mean of |z| of a
Weierstrass-Mandelbrot profile, whose heights, and whose structure function's root, go with G^(D - 2) (Zhang
et al. 2021, doi:10.21203/rs.3.rs-652069/v1, Eq. 1, 14 and 17): flanks h times as high have G h^(1/(D - 2)).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdsim.contact.law import ValidityWarning
from hdsim.drive.parameters import Drive, TeethMesh
from hdsim.errors import PhysicsError
from hdsim.nested import merge

#: Largest roughness that a flank may have, m: the bound of its field.
_ROUGHEST_M = 1e-3
#: Largest factor by which gaps may be worn apart: the bound of ``gap_factor``.
_WIDEST = 1000.0


@dataclass(frozen=True)
class PlayAsTeeth:
    """A drive with teeth that has a play.

    Attributes:
        half_gap_m: mean half-gap of the teeth, m.
        nominal_half_gap_m: the same of the flanks as they were given, m.
        heights: of the flanks over those that were given.
        roughness_m: fractal roughness G of each flank that leaves the half-gap, m.
        dimensions: fractal dimension D of each, which stays.
        rough: whether ``changes`` has these flanks; else so rough ones would be plastic under the mean tooth
            load at rated torque, where the contact's equations end, and the gap is that of the given flanks
            worn apart.
        changes: of the scenario's section ``drive``, nested.
    """

    half_gap_m: float
    nominal_half_gap_m: float
    heights: float
    roughness_m: dict[str, float]
    dimensions: dict[str, float]
    rough: bool
    changes: dict[str, Any]


def half_gap_of_play(drive: Drive, play_rad: float) -> float:
    """Half-gap of every tooth that is a play (rad at the output), m."""
    geometry = drive.geometry
    gain = 1.0
    if drive.arrangement == "flexspline_fixed":
        gain = geometry.circular_spline_teeth / geometry.flexspline_teeth
    lever = geometry.pitch_radius_m * float(np.cos(np.radians(geometry.pressure_angle_deg)))
    return 0.5 * play_rad * gain * lever


def play_as_teeth(drive: Drive, play_rad: float, *, seed: int = 0) -> PlayAsTeeth:
    """The toothed drive that has a lumped drive's play in its flanks.

    Args:
        drive: the lumped drive, whose springs are those of the drive without the play. Its preset, if it has
            one, says which teeth; else they are the default ones.
        play_rad: total play at the output, rad.
        seed: seed of the flanks.

    Raises:
        PhysicsError: no flanks leave such a gap, or the teeth alone would be softer than the whole drive.
    """
    from hdsim.drive.presets import preset
    from hdsim.drive.toothed import Teeth

    given = dict(preset(drive.preset).get("mesh", {})) if drive.preset else {}
    mesh = TeethMesh.model_validate(given | {"model": "teeth"})
    half_gap = half_gap_of_play(drive, play_rad)
    nominal = float(np.mean(mesh.flanks.half_gaps(drive.geometry.flexspline_teeth, seed)))
    heights = half_gap / nominal
    flanks = {"circular_spline": mesh.flanks.circular_spline, "flexspline": mesh.flanks.flexspline}
    dimensions = {name: flank.fractal_dimension for name, flank in flanks.items()}
    roughness = {
        name: flank.fractal_roughness_m * heights ** (1.0 / (flank.fractal_dimension - 2.0))
        for name, flank in flanks.items()
    }
    if not 0.0 < max(roughness.values()) < _ROUGHEST_M:
        raise PhysicsError(f"no roughness of flanks leaves a half-gap of {1e6 * half_gap:.3g} um")
    if heights > _WIDEST:
        raise PhysicsError(
            f"a half-gap of {1e6 * half_gap:.4g} um is {heights:.4g} times that of the flanks: no gear has it"
        )
    torsion = drive.torsion
    softer = 1.0 / torsion.stiffness_k1_nm_per_rad + 0.5 * play_rad / torsion.torque_t1_nm
    new: dict[str, Any] = given.get("flanks", {}) | {
        name: {"fractal_dimension": dimensions[name], "fractal_roughness_m": value}
        for name, value in roughness.items()
    }
    rougher = TeethMesh.model_validate(given | {"model": "teeth", "flanks": new})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        law = rougher.contact.build(rougher.flanks.equivalent())
    lever = half_gap_of_play(drive, 2.0)  # a play of two radians is a half-gap of one lever
    tooth_force = drive.rated_torque_nm / (mesh.engagement.share * drive.geometry.flexspline_teeth * lever)
    # Below this force nothing is elastic; of laws that know none the roughness does not matter.
    rough = getattr(law, "all_plastic_force_n", 0.0) < tooth_force
    changes: dict[str, Any] = {
        "torsion": {"stiffness_k1_nm_per_rad": 1.0 / softer},
        "mesh": given | {"model": "teeth"} | ({"flanks": new} if rough else {"gap_factor": heights}),
    }
    whole = Drive.model_validate(merge(drive.model_dump(exclude={"mesh", "preset"}), changes))
    assert isinstance(whole.mesh, TeethMesh)
    # Raises where the teeth alone are too soft.
    Teeth(whole, whole.mesh, (), extra_half_gap_rad=0.0, seed=seed)
    return PlayAsTeeth(half_gap, nominal, heights, roughness, dimensions, rough, changes)
