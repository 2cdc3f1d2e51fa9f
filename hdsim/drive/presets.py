"""Drives that are ready to use: the drive of Zhang et al. 2021 and catalogue sizes of the CSG series.

A preset is plain data for ``hdsim.drive.parameters.Drive``. What a catalogue prints stands in
``hdsim.drive.catalogue``; what it does not print is estimated here, by the rules in the functions below
(docs/presets.md lists them).
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from functools import cache
from typing import Any

from hdsim.drive.catalogue import (
    SEED,
    SIZES_AND_RATIOS,
    CatalogueFigures,
    csg_figures,
    friction_figures,
)
from hdsim.drive.printed import Figure
from hdsim.errors import PhysicsError
from hdsim.plugins import Plugin, plugins

_SEED_NAME = "seed-2021"
_PRINTED_NAME = "seed-2021-printed-roughness"
_SEED_RADIUS_M = 0.025  # module 0.25 mm, 200 teeth
_SEED_FACE_WIDTH_M = 0.010

#: Section ``mesh.flanks`` with both G as Table 4 of the paper prints them, identified with its Eq. 18.
PRINTED_FLANKS: dict[str, Any] = {
    "circular_spline": {"fractal_dimension": 2.4272, "fractal_roughness_m": 1.245e-10},
    "flexspline": {"fractal_dimension": 2.643, "fractal_roughness_m": 1.8648e-10},
    "structure_function_constant": "printed",
}

_EFFICIENCY_RPM = 2000.0
_STARTING_EXPONENT = math.log(29.0 / 37.0) / math.log(160.0 / 100.0)

_MOTOR_INERTIA_SIZE_20_KG_M2 = 0.5e-4
_WAVE_GENERATOR_INERTIA_SIZE_20_KG_M2 = 0.193e-4
_DAMPING_RATIO = 0.03
_DAMPING_LOAD_KG_M2 = 0.5

_STEEL_KG_PER_M3 = 7850.0
_FACE_WIDTH_PER_RADIUS = _SEED_FACE_WIDTH_M / _SEED_RADIUS_M
_RING_THICKNESS_PER_RADIUS = 1.2e-3 / _SEED_RADIUS_M
_TOOTH_STIFFNESS_PER_WIDTH_PA = 14e9  # 14 N/(µm mm)


def _size_and_ratio(name: str) -> tuple[int, int]:
    """Size and ratio that a preset's name stands for.

    Raises:
        ValueError: unknown name.
    """
    known: dict[str, tuple[int, int]] = {_SEED_NAME: (20, 100), _PRINTED_NAME: (20, 100)}
    known |= {f"csg-{size}-{ratio}": (size, ratio) for size, ratio in SIZES_AND_RATIOS}
    if name in outside():
        raise ValueError(
            f"preset {name!r} is of {outside()[name].distribution}, without a catalogue's figures"
        )
    if name not in known:
        known |= dict.fromkeys(outside(), (0, 0))
        begun = [other for other in known if name and other.startswith(name)]
        near = begun or difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
        raise ValueError(f"unknown preset {name!r}; {hint}known are {', '.join(known)}")
    return known[name]


@cache
def outside() -> dict[str, Plugin]:
    """Presets of other packages by name (entry point ``hdsim.presets``).

    A value is what ``preset`` returns, or a function without arguments that returns it.
    """

    def wrong(one: Plugin) -> str:
        fits = callable(one.value) or isinstance(one.value, Mapping)
        return "" if fits else f"found {one.value!r}, expected a mapping or a function that returns one"

    return plugins("presets", preset_names(), wrong)


def preset_names() -> tuple[str, ...]:
    """Names of hdsim's own presets."""
    return (_SEED_NAME, _PRINTED_NAME, *(f"csg-{size}-{ratio}" for size, ratio in SIZES_AND_RATIOS))


def catalogue_figures(name: str) -> CatalogueFigures:
    """What is printed about a preset's drive, each number with its source.

    The paper behind ``seed-2021`` prints rated torque and geometry; the rest is size 20, ratio 100. The same
    holds for ``seed-2021-printed-roughness``.

    Args:
        name: name of a preset.

    Raises:
        ValueError: unknown name.
    """
    figures = csg_figures(*_size_and_ratio(name))
    if name not in (_SEED_NAME, _PRINTED_NAME):
        return figures
    return replace(
        figures, name=name, rated_torque=Figure(52.0, SEED), pitch_radius=Figure(_SEED_RADIUS_M, SEED)
    )


def preset(name: str) -> dict[str, Any]:
    """Numbers of a drive, as plain data for ``Drive``.

    ``seed-2021`` has the flanks that the paper measured, with the G that its profile needs for them;
    ``seed-2021-printed-roughness`` is the same drive with both G as printed.

    Args:
        name: name of a preset, e.g. ``seed-2021`` or ``csg-20-100``.

    Returns:
        A fresh mapping with the field names of ``hdsim.drive.parameters.Drive``.

    Raises:
        ValueError: unknown name; the message lists the known ones.
    """
    if name in outside():
        one = outside()[name]
        try:
            return deepcopy(dict(one.value() if callable(one.value) else one.value))
        except Exception as error:  # whatever another package does wrong
            raise ValueError(f"preset {name!r} of {one.distribution} fails: {error}") from error
    figures = catalogue_figures(name)
    radius = figures.pitch_radius.value
    face_width = _FACE_WIDTH_PER_RADIUS * radius
    wave_generator = figures.wave_generator_inertia.value
    motor = _MOTOR_INERTIA_SIZE_20_KG_M2 * wave_generator / _WAVE_GENERATOR_INERTIA_SIZE_20_KG_M2
    return {
        "rated_torque_nm": figures.rated_torque.value,
        "geometry": {
            "flexspline_teeth": 2 * figures.ratio,
            "circular_spline_teeth": 2 * figures.ratio + 2,
            "pitch_radius_m": radius,
            "pressure_angle_deg": 10.0,
        },
        "torsion": {
            "stiffness_k1_nm_per_rad": figures.stiffness_k1.value,
            "stiffness_k2_nm_per_rad": figures.stiffness_k2.value,
            "stiffness_k3_nm_per_rad": figures.stiffness_k3.value,
            "torque_t1_nm": figures.torque_t1.value,
            "torque_t2_nm": figures.torque_t2.value,
            "damping_nm_s_per_rad": _torsion_damping(
                figures.stiffness_k2.value, figures.ratio**2 * (motor + wave_generator)
            ),
        },
        "inertia": {
            "motor_kg_m2": motor,
            "wave_generator_kg_m2": wave_generator,
            "ring_kg_m2": _ring_inertia(radius, face_width),
        },
        "friction": _friction(figures),
        "mesh": {
            "model": "teeth",
            "engagement": {"kind": "window", "share": 0.30},
            "tooth_bending_stiffness_n_per_m": _TOOTH_STIFFNESS_PER_WIDTH_PA * face_width,
            **({"flanks": deepcopy(PRINTED_FLANKS)} if name == _PRINTED_NAME else {}),
        },
    }


def friction_from_catalogue(
    ratio: float,
    starting_nm: float,
    running: Mapping[float, float],
    back_driving_nm: float,
    efficiency: float,
    rated_torque_nm: float,
    at_rpm: float,
) -> dict[str, float]:
    """Coulomb, viscous and load-dependent friction that agree with a catalogue's torques and efficiency.

    The law, at the input, is T_in = T_out/N (1 + c_L) + T_c + b w. It gives

    - starting torque T_c,
    - running torque without load T_c + b w,
    - input torque T_out/(N eta) at rated load,
    - back-driving torque T_out = N T_c/(1 - c_L), where T_in = 0 and the losses oppose the output.

    Each is linear in (T_c, b, c_L) (the last one after multiplication by 1 - c_L), so the least squares of
    the relative errors is a linear one.

    Args:
        ratio: N, positive.
        starting_nm: starting torque at the input, N m.
        running: running torque without load at the input, N m, by input speed in rpm.
        back_driving_nm: torque at the output that moves it, N m.
        efficiency: eta at ``rated_torque_nm`` and ``at_rpm``.
        rated_torque_nm: output torque of the efficiency, N m.
        at_rpm: input speed of the efficiency, rpm.

    Returns:
        ``coulomb_nm``, ``viscous_nm_s_per_rad`` and ``load_coefficient``, as in ``Friction``.

    Raises:
        PhysicsError: the figures contradict the law (a negative coefficient, or c_L of 1 and more).
    """
    import numpy as np

    ideal = rated_torque_nm / ratio
    rows = [[1.0 / starting_nm, 0.0, 0.0]]
    right = [1.0]
    for rpm, torque in running.items():
        rows.append([1.0 / torque, _rad_per_s(rpm) / torque, 0.0])
        right.append(1.0)
    rows.append([efficiency / ideal, efficiency * _rad_per_s(at_rpm) / ideal, efficiency])
    right.append(1.0 - efficiency)
    rows.append([ratio / back_driving_nm, 0.0, 1.0])
    right.append(1.0)
    matrix = np.asarray(rows)
    size = np.linalg.norm(matrix, axis=0)  # the unknowns differ by 1e3; without this rcond would cut b off
    solution = np.linalg.lstsq(matrix / size, np.asarray(right), rcond=None)[0] / size
    coulomb, viscous, load = (float(x) for x in solution)
    if min(coulomb, viscous, load) < 0.0 or load >= 1.0:
        raise PhysicsError(
            "the friction figures contradict T_in = T_out/N (1 + c_L) + T_c + b w with T_c, b >= 0 and "
            f"0 <= c_L < 1: found T_c = {coulomb:.4g} N m, b = {viscous:.4g} N m s/rad, c_L = {load:.4g}"
        )
    return {"coulomb_nm": coulomb, "viscous_nm_s_per_rad": viscous, "load_coefficient": load}


def _friction(figures: CatalogueFigures) -> dict[str, float]:
    """Friction of a drive: closed at ratio 100, where it is printed, and scaled to the other ratios.

    Estimate for the other ratios: T_c ~ N^-0.52, the exponent that joins the two starting torques known for
    size 20 (37 mN m at ratio 100, TPI 275; 29 mN m at ratio 160, CPL20-2A in CompliantJointToolbox); b and
    c_L unchanged, since bearing and grease see the same input speed and the flanks slide alike.
    """
    printed = friction_figures(figures.size)
    friction = friction_from_catalogue(
        ratio=100.0,
        starting_nm=printed.input_starting_torque.value,
        running={rpm: torque.value for rpm, torque in printed.running_torque},
        back_driving_nm=printed.back_driving_torque.value,
        efficiency=printed.efficiency.value,
        rated_torque_nm=csg_figures(figures.size, 100).rated_torque.value,
        at_rpm=_EFFICIENCY_RPM,
    )
    friction["coulomb_nm"] *= (figures.ratio / 100.0) ** _STARTING_EXPONENT
    return friction


def _torsion_damping(stiffness: float, input_inertia: float) -> float:
    """Damper parallel to the spring for damping ratio 0.03 (estimate) of the free two-mass mode.

    c = 2 zeta sqrt(K J), J = J_1 J_2/(J_1 + J_2): J_1 motor and wave generator seen from the output,
    J_2 a load of 0.5 kg m^2, K the middle stiffness.
    """
    inertia = input_inertia * _DAMPING_LOAD_KG_M2 / (input_inertia + _DAMPING_LOAD_KG_M2)
    return 2.0 * _DAMPING_RATIO * math.sqrt(stiffness * inertia)


def _ring_inertia(radius: float, face_width: float) -> float:
    """Thin steel ring m r^2 (estimate): the toothed rim, teeth included, 1.2 mm thick at 25 mm radius."""
    thickness = _RING_THICKNESS_PER_RADIUS * radius
    return _STEEL_KG_PER_M3 * 2.0 * math.pi * radius**3 * face_width * thickness


def _rad_per_s(rpm: float) -> float:
    """Revolutions per minute to rad/s."""
    return rpm * math.pi / 30.0
