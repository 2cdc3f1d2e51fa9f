"""The teeth of both splines as drawn: their outlines, and the forces on them.

The flexspline's teeth are drawn once, in a frame of their own that follows the wave generator and lags
behind it by less than half a tooth: after one pitch the toothing looks the same, so that one body shows the
teeth rolling through the mesh at any angle. `mesh_angle` is that frame's angle.
"""

from __future__ import annotations

import numpy as np

from hdsim.log import shapes
from hdsim.log.scene_geometry import SceneGeometry
from hdsim.log.shapes import Array

FRAME = "flexspline_teeth"

_ROOT, _TIP = -0.15, 0.85
"""Of a flexspline tooth, in tooth heights from the pitch line."""
_HALF_WIDTH = 0.24
"""Of a flexspline tooth, in pitches; its flanks are parallel, as the mesh takes them: play does not depend on
how deep a tooth is in its space."""


def mesh_angle(g: SceneGeometry, motor: Array, circular_spline: Array, mesh_twist: Array) -> Array:
    """Angle of the frame of the flexspline's teeth.

    On the major axis a tooth stands in the middle of the circular spline's space, but for the mesh's twist.

    Args:
        g: the drive.
        motor: (n,), angle of the wave generator, rad.
        circular_spline: (n,), its angle, rad.
        mesh_twist: (n,), how far the ring lags behind what the tooth counts ask for, rad.
    """
    pitch = 2 * np.pi / g.circular_spline_teeth
    space = circular_spline - motor
    rolled = space - pitch * np.round(space / pitch)
    return motor + rolled - mesh_twist * (g.flexspline_teeth / g.circular_spline_teeth)


def mesh_twist(g: SceneGeometry, motor: Array, output: Array, ring: Array, kinematic_error: Array) -> Array:
    """How far the ring lags behind the wave generator and the output, rad; all arguments (n,), rad."""
    if g.circular_spline_fixed:
        return motor / g.ratio + kinematic_error - ring
    gain = -g.circular_spline_teeth / g.flexspline_teeth
    return gain * (motor / g.ratio - output + kinematic_error) - ring


def _half_width(g: SceneGeometry) -> float:
    return _HALF_WIDTH * 2 * np.pi * g.pitch_radius_m / g.circular_spline_teeth


def _outline(radius: Array, middle: Array, half_width: Array) -> Array:
    """Points (n k, 3): of each of n teeth k points at radii (n, k), offsets (k,) along the circle."""
    angle = middle[:, None] + half_width / radius
    return shapes.polar(radius.ravel(), angle.ravel())


def flexspline_outline(g: SceneGeometry) -> Array:
    """Outline (6 teeth, 3) of the toothed flexspline in its frame; the major axis is x."""
    h, half = g.tooth_height, _half_width(g)
    angle = np.linspace(0.0, 2 * np.pi, g.flexspline_teeth, endpoint=False)
    heights = h * np.array([_ROOT, _TIP - 0.2, _TIP, _TIP, _TIP - 0.2, _ROOT])
    widths = half * np.array([-1.0, -1.0, -0.6, 0.6, 1.0, 1.0])
    return _outline(g.radius(angle)[:, None] + heights, g.place(angle), widths)


def circular_spline_outline(g: SceneGeometry) -> Array:
    """Inner outline (6 teeth, 3) of the circular spline; the middle of a space is on x."""
    h = g.tooth_height
    # The gap belongs to the ring; as seen from the wave generator the ring's teeth are a little closer.
    space = _half_width(g) + g.half_gap_m * g.flexspline_teeth / g.circular_spline_teeth
    heights = h * np.array([0.0, 0.15, 0.95, 0.95, 0.15, 0.0])
    widths = space + _half_width(g) * np.array([0.4, 0.0, 0.0, 0.0, 0.0, 0.4])
    middle = np.linspace(0.0, 2 * np.pi, g.circular_spline_teeth, endpoint=False)
    radius = np.full((len(middle), 6), g.pitch_radius_m) + heights
    return _outline(radius, middle, widths * np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0]))


def middles(outline: Array) -> Array:
    """For each point of an outline (6 teeth, 3) the angle of the middle of its tooth: (6 teeth,)."""
    tips = outline.reshape(-1, 6, 3)[:, 2:4].mean(axis=1)
    return np.repeat(np.arctan2(tips[:, 1], tips[:, 0]), 6)


def force_bars(g: SceneGeometry, angle: Array, force: Array) -> bytes:
    """Teeth that carry load, coloured, with a bar inwards as long as the force: a serialized LinePrimitive.

    Args:
        g: the drive.
        angle: (teeth,), of each tooth from the major axis before the ring is deformed.
        force: (teeth,), its size in N.

    Returns:
        The lines in the frame of the flexspline's teeth; nothing where no tooth carries load.
    """
    share = force / g.largest_force_n
    engaged = share > 1e-3
    if not engaged.any():
        return b""
    pitch = 2 * np.pi / g.flexspline_teeth
    slot = pitch * np.round((angle[engaged] - _lag(angle, pitch)) / pitch)
    share = share[engaged]
    radius, place = g.radius(slot), g.place(slot)
    foot = radius - g.tooth_height - np.minimum(share, 1.2) * 0.3 * g.pitch_radius_m
    z = 0.16 * g.pitch_radius_m
    tip = radius + (_TIP - 0.1) * g.tooth_height
    points = np.stack([shapes.polar(foot, place, z), shapes.polar(tip, place, z)], axis=1)
    colours = np.repeat(shapes.force_colours(share), 2, axis=0)
    return shapes.segments(points.reshape(-1, 3), colours, 4.0)


def _lag(angle: Array, pitch: float) -> float:
    """How far the teeth are from where the nearest ones are drawn, rad."""
    first = float(angle[0])
    return float(first - pitch * np.round(first / pitch))
