"""The numbers of a drive, with units, bounds and the preset that fills what the user leaves out."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hdsim.contact.parameters import ContactParameters, MajumdarBhushanParameters
from hdsim.number import Number
from hdsim.parts import Parameters
from hdsim.surface.parameters import RoughFlanks

Arrangement = Literal["circular_spline_fixed", "flexspline_fixed"]


def _elastic(drive: Drive) -> bool:
    """Whether the drive has a torsion spring."""
    return drive.mesh.model != "rigid"


#: Sections of the torsion spring: a catalogue's scatter is that of one casting, so they scale together.
_STIFFNESS = Number(0.4, group="stiffness", compliance=True, matters=_elastic)
#: Ends of its sections: knees that a table reads off a smooth curve, so known no better than the stiffness.
_ENDS = Number(0.4, group="section_torques", matters=_elastic)
#: Friction and damping differ more between two drives of a size, and with grease and temperature.
_FRICTION = Number(0.7, far=15.0, may_vanish=True)
_DAMPING = Number(1.0, matters=_elastic, far=15.0, may_vanish=True)
#: Of the teeth: how many share the load, how far they bend, how far apart they are. What the catalogue's
#: stiffness has of them stays as it is, so that few records tell them: a fit moves them when asked.
_SHARE, _EDGE, _BENDING = Number(0.3, asked=True), Number(0.5, asked=True), Number(0.5, asked=True)
_GAP, _PITCH = Number(0.7, asked=True), Number(0.7, may_vanish=True, asked=True)


class Geometry(Parameters):
    """Tooth counts and the circle on which the teeth meet."""

    flexspline_teeth: int = Field(200, ge=20, le=2000)
    """Teeth of the flexspline."""
    circular_spline_teeth: int = Field(202, ge=22, le=2002)
    """Teeth of the circular spline; two more than the flexspline's for a two-lobed wave generator."""
    pitch_radius_m: float = Field(0.025, gt=0, le=1)
    """Radius of the circle on which the teeth meet, m."""
    pressure_angle_deg: float = Field(10.0, ge=0, lt=90)
    """Angle between a tooth's normal force and its tangential force, degrees."""

    @model_validator(mode="after")
    def _two_lobes(self) -> Geometry:
        if self.circular_spline_teeth - self.flexspline_teeth != 2:
            raise ValueError(
                f"circular_spline_teeth must exceed flexspline_teeth by 2 (two-lobed wave generator), "
                f"found {self.circular_spline_teeth} and {self.flexspline_teeth}"
            )
        return self


class Torsion(Parameters):
    """Torsional stiffness of the whole drive at the output, input locked, in three segments."""

    stiffness_k1_nm_per_rad: Annotated[float, _STIFFNESS] = Field(gt=0)
    """Secant stiffness from 0 to the first torque, N m/rad."""
    stiffness_k2_nm_per_rad: Annotated[float, _STIFFNESS] = Field(gt=0)
    """Secant stiffness from the first to the second torque, N m/rad."""
    stiffness_k3_nm_per_rad: Annotated[float, _STIFFNESS] = Field(gt=0)
    """Stiffness above the second torque, N m/rad."""
    torque_t1_nm: Annotated[float, _ENDS] = Field(gt=0)
    """End of the first segment, N m."""
    torque_t2_nm: Annotated[float, _ENDS] = Field(gt=0)
    """End of the second segment, N m."""
    wave_generator_stiffness_nm_per_rad: float | None = Field(None, gt=0)
    """Share of the chain that is the wave generator's bearing, as a stiffness at the output, N m/rad."""
    corner_smoothing_nm: float = Field(0.0, ge=0)
    """Half-width in torque over which a corner between two segments is rounded (0: sharp), N m."""
    damping_nm_s_per_rad: Annotated[float, _DAMPING] = Field(0.0, ge=0)
    """Viscous damping parallel to the torsion spring, at the output, N m s/rad."""

    @model_validator(mode="after")
    def _ordered(self) -> Torsion:
        if self.torque_t2_nm <= self.torque_t1_nm:
            raise ValueError(
                f"torque_t2_nm must exceed torque_t1_nm, found {self.torque_t2_nm} <= {self.torque_t1_nm}"
            )
        return self


class Inertia(Parameters):
    """Moments of inertia of the drive's own parts; the load's belongs to the load."""

    motor_kg_m2: Annotated[float, Number(0.5, far=15.0)] = Field(0.5e-4, gt=0)
    """Motor rotor with what sits on its shaft, kg m^2."""
    wave_generator_kg_m2: float = Field(0.193e-4, ge=0)
    """Wave generator with its bearing's inner ring, kg m^2."""
    ring_kg_m2: float = Field(2.0e-5, gt=0)
    """Toothed ring of the flexspline, kg m^2."""

    @property
    def rotor_kg_m2(self) -> float:
        """All that turns with the motor, kg m^2."""
        return self.motor_kg_m2 + self.wave_generator_kg_m2


#: Default smoothing speed of sign(speed), rad/s of the motor: under 3 N m, where 4 N m drive a size 20 back,
#: it creeps by 0.3 arcsec a minute. A stuck motor costs the default solver no more steps than a creeping one.
STICKS_RAD_PER_S = 2e-6
#: The same where the speed is a measured one, or where a drive is linearised at rest.
RESOLVED_RAD_PER_S = 0.5
#: Damping ratio below which a ring vibrates on from tooth to tooth: at 3 % a prediction costs six times one
#: with the presets' damping, and with none some two hundred times.
RINGS_ON = 0.01


class Friction(Parameters):
    """Friction on the input: (Coulomb + c_L |output torque| / ratio) sign(speed) + viscous * speed.

    The sign is tanh(speed / smoothing speed): below the smoothing speed the drive creeps instead of sticking.
    """

    coulomb_nm: Annotated[float, _FRICTION] = Field(0.0, ge=0)
    """Coulomb friction at the motor shaft, N m."""
    viscous_nm_s_per_rad: Annotated[float, _FRICTION] = Field(0.0, ge=0)
    """Viscous friction at the motor shaft, N m s/rad."""
    load_coefficient: Annotated[float, _FRICTION] = Field(0.0, ge=0, lt=1)
    """Share of the transmitted torque, reduced to the motor shaft, that is lost in the mesh (c_L)."""
    smoothing_velocity_rad_per_s: float = Field(STICKS_RAD_PER_S, gt=0)
    """Motor speed over which sign(speed) is smoothed, rad/s. The default sticks."""

    @property
    def sticks(self) -> bool:
        """Whether the drive sticks at rest; with another smoothing speed than the default it creeps."""
        return self.smoothing_velocity_rad_per_s == STICKS_RAD_PER_S

    def resolved(self, speed: float = RESOLVED_RAD_PER_S) -> Friction:
        """The same with a sign that a measured speed or a linear model can resolve, unless one was chosen.

        A speed from an encoder crosses zero many times while the shaft stands; a sharp sign would make
        friction torque of that noise. At rest the slope of a sharp sign is a wall.

        Args:
            speed: over which the sign is smoothed then, rad/s.
        """
        return self.model_copy(update={"smoothing_velocity_rad_per_s": speed}) if self.sticks else self


class WindowEngagement(Parameters):
    """Two opposite arcs of teeth carry load, centred on the wave generator's major axis."""

    kind: Literal["window"] = "window"
    share: Annotated[float, _SHARE] = Field(0.30, gt=0, le=0.9)
    """Share of the teeth that the arcs hold (sum of the weights over the number of teeth)."""
    edge_teeth: Annotated[float, _EDGE] = Field(8.0, gt=0)
    """Teeth over which the weight rises from 0 to 1 at each end of an arc; over half of its teeth, a bell."""


class ClearanceEngagement(Parameters):
    """The gap grows away from the major axis as (1 - cos 2 phi)/2, so the engaged share grows with torque."""

    kind: Literal["clearance"] = "clearance"
    share: Annotated[float, _SHARE] = Field(0.30, gt=0, le=0.9)
    """Share of the teeth in contact at rated torque; the clearance is calibrated to it."""
    clearance_m: Annotated[float | None, _GAP] = Field(None, gt=0)
    """Clearance on the minor axis, m; given instead of the calibration."""


Engagement = Annotated[WindowEngagement | ClearanceEngagement, Field(discriminator="kind")]


class ToothedMesh(Parameters):
    """What the meshes with teeth have in common."""

    engagement: Engagement = WindowEngagement()
    flanks: RoughFlanks = RoughFlanks()
    contact: ContactParameters = MajumdarBhushanParameters()
    tooth_bending_stiffness_n_per_m: Annotated[float | None, _BENDING] = Field(1.4e8, gt=0)
    """Bending stiffness of one tooth pair in series with its contact, N/m (null: rigid teeth)."""
    pitch_error_m: Annotated[float, _PITCH] = Field(0.0, ge=0)
    """Standard deviation of the teeth's pitch error, m."""
    half_gap_m: Annotated[float | None, _GAP] = Field(None, ge=0)
    """The same half-gap for every tooth, m; given instead of the Weierstrass-Mandelbrot backlash."""
    gap_factor: Annotated[float, _GAP] = Field(1.0, ge=0, le=1000)
    """Factor on every half-gap: 2 is the same flanks with the backlash doubled."""
    gap_along_flank: bool = False
    """Let the gap follow the flank's profile as the contact point slides, instead of each tooth's average."""
    gap_smoothing_m: float = Field(0.0, ge=0, le=1e-5)
    """Half-width over which the dead-zone's corners are rounded, m (0: Eq. 14 as printed)."""
    damping_nm_s_per_rad: float = Field(0.0, ge=0)
    """Viscous damping parallel to the mesh, as a torsional damping at the output, N m s/rad."""
    ring: Literal["dynamic", "static"] = "dynamic"
    """Ring inertia as a degree of freedom, or eliminated by static balance of mesh and cup: inside a gap the
    cup is then without twist, whatever a hysteresis would hold."""


class TeethMesh(ToothedMesh):
    """Every tooth pair on its own."""

    model: Literal["teeth"] = "teeth"


class TabulatedMesh(ToothedMesh):
    """The torque of all teeth from a table over mesh twist and wave-generator angle."""

    model: Literal["tabulated"]
    twist_nodes: int = Field(400, ge=20, le=4000)
    """Nodes over the mesh twist."""
    angle_nodes: int = Field(400, ge=50, le=4000)
    """Nodes over half a turn of the wave generator."""


class LumpedMesh(Parameters):
    """The catalogue's stiffness alone: no teeth, no gap, no ring."""

    model: Literal["lumped"]


class RigidMesh(Parameters):
    """No compliance at all: the output follows the motor, kinematic error included."""

    model: Literal["rigid"]


Mesh = Annotated[TeethMesh | TabulatedMesh | LumpedMesh | RigidMesh, Field(discriminator="model")]


class Drive(Parameters):
    """A harmonic drive. ``preset`` fills every number that is not given here."""

    preset: str | None = None
    """Name of a preset (``hdsim presets`` lists them)."""
    arrangement: Arrangement = "circular_spline_fixed"
    """Which component is fixed; the other of the two splines is the output."""
    rated_torque_nm: float = Field(gt=0)
    """Rated output torque, N m."""
    geometry: Geometry = Geometry()
    torsion: Torsion
    inertia: Inertia = Inertia()
    friction: Friction = Friction()
    mesh: Mesh = TeethMesh()

    @model_validator(mode="before")
    @classmethod
    def _fill_from_preset(cls, given: Any) -> Any:
        """Merge what is given over the preset, section by section."""
        if not isinstance(given, dict) or not isinstance(given.get("preset"), str):
            return given
        from hdsim.drive.presets import preset

        return _merged(preset(given["preset"]), given)

    def resolved(self, speed: float = RESOLVED_RAD_PER_S) -> Drive:
        """The drive as predictions along measured motions and linear models see it: ``Friction.resolved``."""
        return self.model_copy(update={"friction": self.friction.resolved(speed)})

    def settled(self) -> Drive:
        """The same with the ring in static balance, where next to nothing damps it.

        Its vibration, excited by every tooth that touches or parts, would be followed period by period, tens
        of thousands a second, and end where only rounding decides. The ring's damping ratio is at most that
        beside K3 alone, c / (2 sqrt(K3 J)).
        """
        mesh = self.mesh
        if not isinstance(mesh, TeethMesh | TabulatedMesh) or mesh.ring == "static":
            return self
        damping = self.torsion.damping_nm_s_per_rad + mesh.damping_nm_s_per_rad
        critical = 2.0 * math.sqrt(self.torsion.stiffness_k3_nm_per_rad * self.inertia.ring_kg_m2)
        if damping >= RINGS_ON * critical:
            return self
        return self.model_copy(update={"mesh": mesh.model_copy(update={"ring": "static"})})

    @property
    def least_stiffness_nm_per_rad(self) -> float:
        """Of the torsion spring, in its softest segment, N m/rad; infinite where the mesh is rigid."""
        chain = self.torsion
        if isinstance(self.mesh, RigidMesh):
            return math.inf
        return min(
            chain.stiffness_k1_nm_per_rad, chain.stiffness_k2_nm_per_rad, chain.stiffness_k3_nm_per_rad
        )

    @property
    def ratio(self) -> float:
        """Signed ratio motor angle / output angle: -z_f/(z_c - z_f) or z_c/(z_c - z_f)."""
        z_f, z_c = self.geometry.flexspline_teeth, self.geometry.circular_spline_teeth
        return -z_f / (z_c - z_f) if self.arrangement == "circular_spline_fixed" else z_c / (z_c - z_f)


#: A preset's mesh and the one that tabulates it.
_SAME_TEETH = ("teeth", "tabulated")


def _merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """``over`` laid over ``base``, mappings merged; a change of a mesh's model or a law drops the base's.

    All but one change: a table of the teeth is made from the teeth that the preset has.
    """
    result = dict(base)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(value, dict) and isinstance(below, dict):
            changed = any(
                tag in value and value[tag] != below.get(tag) and (below.get(tag), value[tag]) != _SAME_TEETH
                for tag in ("model", "law", "kind")
            )
            result[key] = dict(value) if changed else _merged(below, value)
        else:
            result[key] = value
    return result
