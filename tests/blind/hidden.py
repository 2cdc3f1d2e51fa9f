"""The effects that are hidden in plants: their numbers, where they can be seen, and what they are called.

Every builder gives a plant's changes from a size, a handful of uniform draws and whether the catalogue's own
formula is wanted. Builders with the catalogue's formula also say which values a diagnosis should recover.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from drives import GRAVITY, Drive

Changes = dict[str, float]
Expected = dict[str, float]
Builder = Callable[[Drive, np.ndarray, float, bool], Changes]

ARCMIN = math.pi / 10800
MOVING = ("swing", "moves", "chirp", "constant")
ANY = (*MOVING, "locked")


@dataclass(frozen=True)
class Hidden:
    """An effect.

    Attributes:
        name: what it is called here; the catalogue's name where it has one.
        build: the plant's changes at a size.
        start: size at which sizing starts.
        most: largest size that is physical.
        accepted: names of the catalogue that are right.
        motions: motions that excite it.
        arm: needs the weight of an arm.
        lacks: numbers that the base model must not have.
        rates: rates of the log that can show it, Hz.
        seconds: length of the record, s (0: as drawn).
        speed: factor on the motion's speed.
        expected: fields that should be recovered when the formula is the catalogue's.
    """

    name: str
    build: Builder
    start: float = 1.0
    most: float = 100.0
    accepted: tuple[str, ...] = ()
    motions: tuple[str, ...] = MOVING
    arm: bool = False
    lacks: tuple[str, ...] = ()
    rates: tuple[int, ...] = (500, 1000, 1000, 2000)
    seconds: float = 0.0
    expected: Callable[[Drive, Changes], Expected] | None = None
    speed: float = 1.0


def _between(low: float, high: float, draw: float) -> float:
    return float(low + (high - low) * draw)


def _phase(draw: float) -> float:
    return float(2 * math.pi * draw)


def _twist(d: Drive) -> float:
    return d.torques[0] / d.stiffness[0]


def kinematic(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    a = 1e-5 * x
    found = {"ke_2": a, "ke_2_phase": _phase(r[0]), "ke_rel": _between(0.4, 0.8, r[1]) * a,
             "ke_rel_phase": _phase(r[2]), "ke_4": 0.35 * a, "ke_4_phase": _phase(r[3])}  # fmt: skip
    return found if same else found | {"ke_6": 0.25 * a, "ke_out3": 0.2 * a}


def kinematic_expected(d: Drive, c: Changes) -> Expected:
    found = {}
    for k, name in enumerate(("ke_2", "ke_rel", "ke_4")):
        found[f"components.{k}.amplitude_arcmin"] = c[name] / ARCMIN
        found[f"components.{k}.phase_deg"] = math.degrees(c[f"{name}_phase"])
    return found


def generator_once(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    skew = 0.0 if same else _between(0.1, 0.3, r[1])
    return {"wg_once": 1e-5 * x, "wg_once_phase": _phase(r[0]), "wg_once_skew": skew}


def tooth(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    if same:
        return {
            "bump": -1e-5 * x,
            "bump_at": math.pi * r[0],
            "bump_width": math.radians(15.0),
            "bump_form": 1.0,
        }
    return {
        "bump": -1e-5 * x, "bump_at": math.pi * r[0], "bump_width": _between(0.16, 0.35, r[1]),
        "bump_passes": 1.0 if r[2] < 0.5 else 2.0, "bump_output": 1.0 if r[3] < 0.6 else 0.0,
    }  # fmt: skip


def tooth_expected(d: Drive, c: Changes) -> Expected:
    return {"amplitude_arcmin": c["bump"] / ARCMIN, "position_deg": math.degrees(c["bump_at"]),
            "width_deg": math.degrees(c["bump_width"])}  # fmt: skip


def stribeck(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"stribeck": d.coulomb * x, "stribeck_speed": _between(3, 9, r[0]), "stribeck_form": float(same)}


def bristles(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    if same:
        # On top of the drive's own Coulomb friction.
        low = 0.5 * d.coulomb * min(1.0, x)
        return {"bristle": d.coulomb / 4e-3, "bristle_coulomb": low, "bristle_static": low + d.coulomb * x,
                "bristle_speed": _between(3, 7, r[0]), "bristle_damping": 1e-3 * d.coulomb / 0.03,
                "bristle_form": 1.0}  # fmt: skip
    # Instead of it.
    return {"coulomb": 0.0, "bristle": d.coulomb / (_between(3e-3, 8e-3, r[1]) * min(1.0, 2 * x)),
            "bristle_coulomb": d.coulomb, "bristle_static": d.coulomb * (1 + x),
            "bristle_speed": _between(3, 9, r[0])}  # fmt: skip


def bristles_expected(d: Drive, c: Changes) -> Expected:
    return {"coulomb_nm": c["bristle_coulomb"], "static_nm": c["bristle_static"],
            "stribeck_velocity_rad_per_s": c["bristle_speed"],
            "stiffness_nm_per_rad": c["bristle"]}  # fmt: skip


def ripple(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    order = (6.0, 10.0, 12.0)[int(2.999 * r[0])]
    found = {"ripple_a": 0.1 * d.coulomb * x, "ripple_a_order": order, "ripple_a_phase": _phase(r[1])}
    if same:
        return found
    second = {
        "ripple_b": 0.5 * found["ripple_a"],
        "ripple_b_order": 2 * order,
        "ripple_b_phase": _phase(r[2]),
    }
    return found | second | {"ripple_c": 0.35 * found["ripple_a"], "ripple_c_order": 4.0}


def ripple_expected(d: Drive, c: Changes) -> Expected:
    return {"components.0.order": c["ripple_a_order"], "components.0.cogging_nm": c["ripple_a"],
            "components.0.phase_deg": math.degrees(c["ripple_a_phase"])}  # fmt: skip


def load_friction(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    size = 0.05 * d.torques[0] * x
    viscous = _between(0.3, 1.0, r[0]) * size * abs(d.ratio) / d.top_speed
    return {"load_coulomb": size, "load_viscous": viscous, "load_form": float(same)}  # fmt: skip


def hysteresis(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"maxwell": 0.05 * d.torques[0] * x, "maxwell_reach": _between(0.6, 1.5, r[0]) * _twist(d),
            "maxwell_form": float(same), "maxwell_power": 12.0 * same}  # fmt: skip


def bouc_wen(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    size = 0.05 * d.torques[0] * x
    reach = _between(0.15, 0.5, r[0]) * _twist(d)
    return {"duhem": size, "duhem_stiffness": size / reach, "duhem_power": 1.0 if same else 2.0}


def backlash(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"gap": 1e-5 * x, "gap_rounding": 0.0 if same else 0.15}


def cubic(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"cubic": 0.02 * d.stiffness[0] / _twist(d) ** 2 * x, "cubic_scale": 1.5 * _twist(d),
            "cubic_form": float(same)}  # fmt: skip


def flexspline(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"flexspline": 0.05 / d.stiffness[0] * x, "flexspline_form": float(same),
            "flexspline_coefficient": _between(0.5, 1.5, r[0]) / d.torques[0]}  # fmt: skip


def generator(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"generator": 0.05 / d.stiffness[0] * x, "generator_form": float(same),
            "generator_coefficient": _between(0.5, 1.5, r[0]) * abs(d.ratio) / d.torques[0]}  # fmt: skip


def mount(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    compliance = 0.05 / d.stiffness[0] * x
    if same:
        return {"mount": compliance}
    speed = 2 * math.pi * _between(60, 140, r[0])
    inertia = 1.0 / compliance / speed**2
    return {"mount": compliance, "mount_inertia": inertia, "mount_damping": 0.1 * inertia * speed}


def thermal(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    power = (d.coulomb + d.viscous * 1.5 * d.top_speed) * 1.5 * d.top_speed
    return {
        "thermal": 0.03 * x,
        "heat_capacity": _between(0.7, 1.2, r[0]) * power,
        "thermal_form": float(same),
    }


def loss(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"extra_loss": 0.05 * x, "loss_form": float(same), "loss_scale": d.torques[0] / abs(d.ratio),
            "loss_power": _between(1.15, 1.3, r[0])}  # fmt: skip


def unbalance(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"weight": 0.05 * d.torques[0] * x, "weight_phase": _phase(r[0])}


def rotor(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"motor_weight": 0.1 * d.coulomb * x, "motor_weight_phase": _phase(r[0])}


def friction(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    power = 1.0 if same else _between(0.75, 0.9, r[0])
    return {"extra_coulomb": d.coulomb * x, "extra_viscous": d.viscous * d.top_speed ** (1 - power) * x,
            "extra_power": power, "algebraic_sign": float(not same)}  # fmt: skip


def sensor_ripple(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    found = {"sensor_ripple": 0.01 * d.torques[0] * x, "sensor_order": 2.0 if r[0] < 0.5 else 4.0,
             "sensor_phase": _phase(r[1])}  # fmt: skip
    return found if same else found | {"sensor_load": 0.3, "sensor_second": 0.3}


def _degrees(name: str, phase: str, unit: float, field: str, angle: str, sign: float = 1.0):
    return lambda d, c: {field: c[name] / unit, angle: sign * math.degrees(c[phase])}


HYSTERESIS = ("torsional_hysteresis_duhem", "torsional_hysteresis_maxwell")
BY_TORQUE = ("swing", "moves", "chirp", "locked")

EFFECTS = (
    Hidden("kinematic_error", kinematic, most=60, expected=kinematic_expected),
    Hidden("wave_generator_eccentricity", generator_once, most=60, expected=_degrees(
        "wg_once", "wg_once_phase", 0.02e-3 / 25, "eccentricity_um", "phase_deg")),
    Hidden("damaged_tooth", tooth, most=100, expected=tooth_expected),
    Hidden("output_eccentricity",
           lambda d, r, x, same: {"out_once": 1e-5 * x, "out_once_phase": _phase(r[0])}, most=100,
           accepted=("output_eccentricity", "sensors"), expected=_degrees(
               "out_once", "out_once_phase", 1e-3 / 25, "eccentricity_um", "phase_deg")),
    Hidden("output encoder eccentricity",
           lambda d, r, x, same: {"encoder_once": 1e-5 * x, "encoder_phase": _phase(r[0])}, most=100,
           accepted=("sensors", "output_eccentricity"), expected=_degrees(
               "encoder_once", "encoder_phase", ARCMIN, "output_angle.eccentricity_arcmin",
               "output_angle.eccentricity_phase_deg", -1.0)),
    Hidden("output encoder delay", lambda d, r, x, same: {"delay": 1e-4 * x}, most=60, accepted=("sensors",),
           motions=("swing", "moves", "chirp"), expected=lambda d, c: {"output_angle.delay_s": c["delay"]}),
    Hidden("torque-sensor ripple", sensor_ripple, most=60, accepted=("sensors",), expected=lambda d, c: {
        "output_torque.ripple.0.order": c["sensor_order"],
        "output_torque.ripple.0.amplitude_nm": c["sensor_ripple"],
        "output_torque.ripple.0.phase_deg": math.degrees(c["sensor_phase"])}),
    Hidden("stribeck_friction", stribeck, most=4, expected=lambda d, c: {
        "extra_static_nm": c["stribeck"], "stribeck_velocity_rad_per_s": c["stribeck_speed"]}),
    Hidden("lugre_friction", bristles, most=3, motions=ANY, expected=bristles_expected),
    Hidden("motor_torque_ripple", ripple, most=60, rates=(1000, 1000, 2000), expected=ripple_expected),
    Hidden("load_side_friction", load_friction, most=20, expected=lambda d, c: {
        "coulomb_nm": c["load_coulomb"], "viscous_nm_s_per_rad": c["load_viscous"]}),
    Hidden("torsional_hysteresis_maxwell", hysteresis, most=10, accepted=HYSTERESIS, motions=BY_TORQUE,
           arm=True,
           expected=lambda d, c: {"slip_torque_nm": c["maxwell"]}),
    Hidden("torsional_hysteresis_duhem", bouc_wen, most=10, accepted=HYSTERESIS, motions=BY_TORQUE, arm=True,
           expected=lambda d, c: {"saturation_torque_nm": c["duhem"],
                                  "saturation_twist_mrad": 1e3 * c["duhem"] / c["duhem_stiffness"]}),
    Hidden("output_backlash", backlash, most=60, motions=BY_TORQUE,
           expected=lambda d, c: {"backlash_arcmin": c["gap"] / ARCMIN}),
    Hidden("stiffness_nonlinearity", cubic, most=60, motions=BY_TORQUE, arm=True,
           expected=lambda d, c: {"cubic_nm_per_rad3": c["cubic"]}),
    Hidden("flexspline_stiffening", flexspline, most=60, motions=BY_TORQUE, arm=True, expected=lambda d, c: {
        "stiffness_nm_per_rad": 1 / c["flexspline"], "coefficient_per_nm": c["flexspline_coefficient"]}),
    Hidden("wave_generator_compliance", generator, most=60, motions=BY_TORQUE, arm=True,
           expected=lambda d, c: {
        "stiffness_nm_per_rad": 1 / (c["generator"] * d.ratio**2),
        "coefficient_per_nm": c["generator_coefficient"]}),
    Hidden("base_flexibility", mount, most=40, motions=("swing", "moves", "chirp"), arm=True,
           expected=lambda d, c: {"stiffness_nm_per_rad": 1 / c["mount"]}),
    Hidden("thermal_friction", thermal, most=5, motions=("swing", "moves", "constant"), seconds=20.0,
           speed=3.0,
           expected=lambda d, c: {"viscosity_coefficient_per_k": c["thermal"],
                                  "heat_capacity_j_per_k": c["heat_capacity"]}),
    Hidden("load_dependent_loss", loss, most=4, arm=True, lacks=("load_loss",),
           expected=lambda d, c: {"coefficient": c["extra_loss"]}),
    Hidden("unbalance", unbalance, most=40, expected=_degrees(
        "weight", "weight_phase", GRAVITY, "output_kg_m", "output_phase_deg")),
    Hidden("unbalance of the rotor", rotor, most=60, accepted=("unbalance",), expected=_degrees(
        "motor_weight", "motor_weight_phase", GRAVITY, "motor_kg_m", "motor_phase_deg")),
    Hidden("input_coulomb_viscous", friction, most=3, lacks=("coulomb", "viscous"), expected=lambda d, c: {
        "coulomb_nm": c["extra_coulomb"], "viscous_nm_s_per_rad": c["extra_viscous"]}),
)  # fmt: skip

#: Not in the catalogue. ``fixed`` places in the range of every motion.
OUTSIDE = (
    Hidden("spring catch", lambda d, r, x, same: {
        "catch": 0.1 * d.torques[0] * x, "catch_at": _between(0.15, 0.4, r[0]), "catch_width": 0.06},
        most=20),
    Hidden("cable", lambda d, r, x, same: {
        "cable": 0.1 * d.torques[0] * x, "cable_at": _between(0.05, 0.2, r[0]), "cable_width": 0.25},
        most=40),
    Hidden("drifting torque", lambda d, r, x, same: {"drift": d.coulomb * x}, most=10),
    Hidden("churning", lambda d, r, x, same: {"churn": 0.5 * d.coulomb / d.top_speed**2 * x}, most=6),
    Hidden("cogging of the load", lambda d, r, x, same: {
        "cogging": 0.05 * d.torques[0] * x, "cogging_order": float(7 + 2 * int(3 * r[0]))}, most=40),
    Hidden("spring-mounted mass on the output", lambda d, r, x, same: {
        "absorber_inertia": 0.05 * d.load_inertia * x,
        "absorber": 0.05 * d.load_inertia * x * (2 * math.pi * _between(2.5, 6.0, r[0])) ** 2},
        most=10, motions=("moves", "chirp")),
    Hidden("friction in a zone of the output", lambda d, r, x, same: {
        "zone": d.coulomb * x, "zone_at": _between(0.1, 0.3, r[0]), "zone_width": 0.1}, most=6),
    Hidden("dragging brake", lambda d, r, x, same: {"brake": d.coulomb * x}, most=6),
    Hidden("saturating motor", lambda d, r, x, same: {"saturation": 0.3 * x}, most=3, arm=True),
)  # fmt: skip

KNOWN = {effect.name: effect for effect in (*EFFECTS, *OUTSIDE)}
