"""What a scene has to know of the drive, and what a recording tells of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hdsim.errors import InputError
from hdsim.log.shapes import Array

if TYPE_CHECKING:
    from hdsim.recording import Recording

GEOMETRY_RECORD = "hdsim.scene"
GEOMETRY_KEY = "geometry"
"""Entry of a run's metadata: JSON of the fields of `SceneGeometry` that are known."""
#: What a recording needs for a scene, and the errors that it shows, the first that is there.
ANGLES = ("motor_angle", "output_angle")
ERROR_CHANNELS = ("transmission_error", "tracking_error")


@dataclass(frozen=True)
class SceneGeometry:
    """What the scene has to know of the drive.

    Args:
        flexspline_teeth: number of teeth.
        circular_spline_teeth: number of teeth.
        pitch_radius_m: radius of the circle on which the teeth meet.
        circular_spline_fixed: the flexspline is the output; else the circular spline is.
        deflection_factor: by how much the flexspline's deflection is exaggerated.
        error_factor: by how much the error of the output is exaggerated.
        largest_force_n: force at the end of the colour scale.
    """

    flexspline_teeth: int = 200
    circular_spline_teeth: int = 202
    pitch_radius_m: float = 0.025
    circular_spline_fixed: bool = True
    deflection_factor: float = 6.0
    error_factor: float = 500.0
    largest_force_n: float = 50.0

    @classmethod
    def from_metadata(cls, metadata: Mapping[str, str]) -> SceneGeometry:
        """What a run's metadata say under ``geometry``; the defaults for the rest."""
        try:
            found = json.loads(metadata.get(GEOMETRY_KEY, "{}"))
            kinds = {name: type(value) for name, value in asdict(cls()).items()}
            return cls(**{name: kind(found[name]) for name, kind in kinds.items() if name in found})
        except (ValueError, TypeError) as error:
            raise InputError(f"the metadata's {GEOMETRY_KEY} is no drive geometry: {error}") from None

    @property
    def drawn_deflection(self) -> float:
        """Radial deflection as drawn, in m: the difference of the two pitch radii times its factor."""
        difference = 1.0 - self.flexspline_teeth / self.circular_spline_teeth
        return self.pitch_radius_m * difference * self.deflection_factor

    @property
    def tooth_height(self) -> float:
        """Height of a tooth as drawn, in m."""
        return 0.045 * self.pitch_radius_m

    def radius(self, angle: Array) -> Array:
        """Pitch radius of the flexspline as drawn, at angles from the major axis; it meets the circular
        spline on the major axis.
        """
        return self.pitch_radius_m - self.drawn_deflection * (1.0 - np.cos(2.0 * angle))


def geometry_of(recording: Recording) -> SceneGeometry:
    """Geometry that a recording tells: its metadata's, its tooth count, scales for its forces and errors."""
    g = SceneGeometry.from_metadata(recording.metadata)
    teeth = recording.tables.get("teeth")
    count, force = g.flexspline_teeth, g.largest_force_n
    if teeth is not None and "normal_force" in teeth and len(teeth):
        count = teeth["normal_force"].shape[1]
        largest = float(np.nanmax(np.abs(teeth["normal_force"])))
        force = largest if largest > 0 else force
    factor = g.error_factor
    error = next((recording[c] for c in ERROR_CHANNELS if c in recording), None)
    if error is not None and np.isfinite(error).any() and np.nanmax(np.abs(error)) > 0:
        # The largest error points a sixth of a turn away, by a factor of one digit.
        wanted = np.pi / 6 / float(np.nanmax(np.abs(error[np.isfinite(error)])))
        power = 10.0 ** np.floor(np.log10(wanted))
        factor = max(1.0, float(np.floor(wanted / power) * power))
    difference = g.circular_spline_teeth - g.flexspline_teeth
    return replace(
        g,
        flexspline_teeth=count,
        circular_spline_teeth=count + difference,
        error_factor=factor,
        largest_force_n=force,
    )
