"""What a scene has to know of the drive, and what a recording tells of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hdsim.errors import InputError
from hdsim.log import naming
from hdsim.log.shapes import Array
from hdsim.recording import Table

if TYPE_CHECKING:
    from hdsim.recording import Recording

GEOMETRY_RECORD = "hdsim.scene"
GEOMETRY_KEY = "geometry"
"""Entry of a run's metadata: JSON of the fields of `SceneGeometry` that are known."""
#: What a recording needs for a scene, and the errors that it shows, the first that is there.
ANGLES = ("motor_angle", "output_angle")
ERROR_CHANNELS = ("transmission_error", "tracking_error")
_LEAST_TEETH, _MOST_TEETH = 20, 700
MEASURED_OUTPUT = "measured_output_angle"
"""Channel of a machine that is shown beside the drive, as a ghost pointer."""


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
        arm_angle_rad: where the arm on the output points at output angle 0; 0 is right, pi/2 up.
        gravity: whether gravity pulls at the arm; it points down, as drawn.
        half_gap_m: play of a tooth to each side, along the pitch circle.
    """

    flexspline_teeth: int = 200
    circular_spline_teeth: int = 202
    pitch_radius_m: float = 0.025
    circular_spline_fixed: bool = True
    deflection_factor: float = 6.0
    error_factor: float = 500.0
    largest_force_n: float = 50.0
    arm_angle_rad: float = 0.0
    gravity: bool = False
    half_gap_m: float = 0.0

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
    def ratio(self) -> float:
        """Motor angle over output angle; negative where the output turns against the motor."""
        difference = self.circular_spline_teeth - self.flexspline_teeth
        if self.circular_spline_fixed:
            return -self.flexspline_teeth / difference
        return self.circular_spline_teeth / difference

    @property
    def deflection(self) -> float:
        """Radial deflection of the flexspline on the major axis, m: the difference of the pitch radii."""
        return self.pitch_radius_m * (1.0 - self.flexspline_teeth / self.circular_spline_teeth)

    @property
    def drawn_deflection(self) -> float:
        """The same as drawn."""
        return self.deflection * self.deflection_factor

    @property
    def tooth_height(self) -> float:
        """Height of a tooth as drawn, in m."""
        return 0.045 * self.pitch_radius_m

    def radius(self, angle: Array) -> Array:
        """Pitch radius of the flexspline as drawn, at angles from the major axis; it meets the circular
        spline on the major axis.
        """
        return self.pitch_radius_m - self.drawn_deflection * (1.0 - np.cos(2.0 * angle))

    def place(self, angle: Array) -> Array:
        """Where a tooth stands that is at an angle from the major axis before the ring is deformed.

        A ring that keeps its length moves round, too, by half its radial deflection times sin 2 phi. That
        is what keeps the teeth in the middle of the circular spline's spaces over a wide arc. It is drawn
        as it is, not exaggerated.
        """
        return angle - 0.5 * self.deflection / self.pitch_radius_m * np.sin(2.0 * angle)


def rounded_up(value: float) -> float:
    """The next number that reads well: 1, 1.5, 2, 3, 4, 5, 6 or 8 times a power of ten."""
    if not (np.isfinite(value) and value > 0):
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    digits = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
    return float(power * next(d for d in digits if d >= value / power * (1 - 1e-9)))


def drawn_state(recording: Recording) -> Table | None:
    """The angles that a scene shows: the state's; of a comparison the model's, with the measured ones beside.

    Where a comparison has one angle only, the ratio gives the other.

    A measured error is drawn about its mean, because the zeros of two encoders need not agree.

    Returns:
        None where an angle is missing.
    """
    tables = recording.tables
    state = tables.get("state")
    if state is None and "measured" in tables:
        measured, after = tables["measured"], tables.get("after")
        state = Table(measured.time, dict(measured.columns))
        if after is not None and "output_angle" in after and "output_angle" in measured:
            state.columns[MEASURED_OUTPUT] = measured.columns["output_angle"]
            state.columns |= {c: after.columns[c] for c in ("output_angle", *ERROR_CHANNELS) if c in after}
        elif "ratio" in recording.metadata:
            _add_other_angle(state, float(recording.metadata["ratio"]))
    if state is None or not len(state) or not all(c in state and state[c].ndim == 1 for c in ANGLES):
        return None
    if MEASURED_OUTPUT not in state and _is_measured(recording):
        state = Table(state.time, dict(state.columns))
        for name in ERROR_CHANNELS:
            if name in state and np.isfinite(state[name]).any():
                centred = state[name] - np.nanmean(state[name])
                state.columns[name] = replace(state.columns[name], values=centred)
    return state


def _add_other_angle(state: Table, ratio: float) -> None:
    """Of a machine with one encoder: the angle on the other side, as the ratio has it."""
    for one, other, factor in (
        ("motor_angle", "output_angle", 1 / ratio),
        ("output_angle", "motor_angle", ratio),
    ):
        if one in state and other not in state:
            state.columns[other] = replace(state.columns[one], values=state[one] * factor)
            return


def _is_measured(recording: Recording) -> bool:
    return recording.metadata.get(naming.ORIGIN_KEY) == naming.MEASURED


def _of_ratio(g: SceneGeometry, ratio: float) -> SceneGeometry:
    """The geometry of a machine whose ratio alone is known: two teeth of difference, as most drives."""
    teeth = round(2 * abs(ratio))
    if not _LEAST_TEETH <= teeth <= _MOST_TEETH:
        return g
    if ratio < 0:
        return replace(g, flexspline_teeth=teeth, circular_spline_teeth=teeth + 2)
    return replace(g, flexspline_teeth=teeth - 2, circular_spline_teeth=teeth, circular_spline_fixed=False)


def geometry_of(recording: Recording) -> SceneGeometry:
    """Geometry that a recording tells: its metadata's, its tooth count, scales for its forces and errors."""
    g = SceneGeometry.from_metadata(recording.metadata)
    if GEOMETRY_KEY not in recording.metadata and "ratio" in recording.metadata:
        g = _of_ratio(g, float(recording.metadata["ratio"]))
    teeth = recording.tables.get("teeth")
    count, force = g.flexspline_teeth, g.largest_force_n
    if teeth is not None and "normal_force" in teeth and len(teeth):
        count = teeth["normal_force"].shape[1]
        largest = float(np.nanmax(np.abs(teeth["normal_force"])))
        force = largest if largest > 0 else force
    factor = g.error_factor
    state = drawn_state(recording)
    error = None if state is None else next((state[c] for c in ERROR_CHANNELS if c in state), None)
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
        largest_force_n=rounded_up(force),
    )
