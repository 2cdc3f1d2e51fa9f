"""What hidden effects do to a plant: a builder each, which gives the plant's changes.

A builder takes the drive, a handful of uniform draws, a size and whether the catalogue's own formula is
wanted. For the catalogue's formula there are functions that say which values a diagnosis should recover.
"""

from __future__ import annotations

import math

import numpy as np
from drives import Drive

Changes = dict[str, float]
Expected = dict[str, float]

ARCMIN = math.pi / 10800


def between(low: float, high: float, draw: float) -> float:
    return float(low + (high - low) * draw)


def phase(draw: float) -> float:
    return float(2 * math.pi * draw)


def twist(d: Drive) -> float:
    return d.torques[0] / d.stiffness[0]


def kinematic(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    a = 1e-5 * x
    found = {"ke_2": a, "ke_2_phase": phase(r[0]), "ke_rel": between(0.4, 0.8, r[1]) * a,
             "ke_rel_phase": phase(r[2]), "ke_4": 0.35 * a, "ke_4_phase": phase(r[3])}  # fmt: skip
    return found if same else found | {"ke_6": 0.25 * a, "ke_out3": 0.2 * a}


def kinematic_expected(d: Drive, c: Changes) -> Expected:
    found = {}
    for k, name in enumerate(("ke_2", "ke_rel", "ke_4")):
        found[f"components.{k}.amplitude_arcmin"] = c[name] / ARCMIN
        found[f"components.{k}.phase_deg"] = math.degrees(c[f"{name}_phase"])
    return found


def uneven(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"uneven": 0.005 * d.stiffness[0] * x, "uneven_phase": phase(r[0]), "uneven_form": float(same)}


def uneven_expected(d: Drive, c: Changes) -> Expected:
    return {"components.0.stiffness_nm_per_rad": c["uneven"],
            "components.0.phase_deg": math.degrees(c["uneven_phase"])}  # fmt: skip


def lumpy(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    size = 0.05 * d.coulomb * x
    return {"lumpy_1": between(0.3, 1.0, r[0]) * size, "lumpy_1_phase": phase(r[1]), "lumpy_2": size,
            "lumpy_2_phase": phase(r[2]), "lumpy_form": float(same)}  # fmt: skip


def lumpy_expected(d: Drive, c: Changes) -> Expected:
    found = {}
    for k, name in enumerate(("lumpy_1", "lumpy_2")):
        found[f"components.{k}.amplitude_nm"] = c[name]
        found[f"components.{k}.phase_deg"] = math.degrees(c[f"{name}_phase"])
    return found


def warm(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"warm": 5e-4 * x, "warm_form": float(same), "heat_capacity": between(3, 10, r[0])}


def ball(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"ball": 0.05 * d.coulomb * x, "ball_phase": phase(r[0]), "ball_share": between(0.07, 0.12, r[1]),
            "ball_form": float(same)}  # fmt: skip


def ball_expected(d: Drive, c: Changes) -> Expected:
    return {"components.0.friction_nm": c["ball"], "components.0.phase_deg": math.degrees(c["ball_phase"]),
            "ball_to_pitch_diameter": c["ball_share"]}  # fmt: skip


def generator_once(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    skew = 0.0 if same else between(0.1, 0.3, r[1])
    return {"wg_once": 1e-5 * x, "wg_once_phase": phase(r[0]), "wg_once_skew": skew}


def tooth(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    if same:
        return {
            "bump": -1e-5 * x,
            "bump_at": math.pi * r[0],
            "bump_width": math.radians(15.0),
            "bump_form": 1.0,
        }
    return {
        "bump": -1e-5 * x, "bump_at": math.pi * r[0], "bump_width": between(0.16, 0.35, r[1]),
        "bump_passes": 1.0 if r[2] < 0.5 else 2.0, "bump_output": 1.0 if r[3] < 0.6 else 0.0,
    }  # fmt: skip


def tooth_expected(d: Drive, c: Changes) -> Expected:
    return {"amplitude_arcmin": c["bump"] / ARCMIN, "position_deg": math.degrees(c["bump_at"]),
            "width_deg": math.degrees(c["bump_width"])}  # fmt: skip


def stribeck(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"stribeck": d.coulomb * x, "stribeck_speed": between(3, 9, r[0]), "stribeck_form": float(same)}


def bristles(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    if same:
        # On top of the drive's own Coulomb friction.
        low = 0.5 * d.coulomb * min(1.0, x)
        return {"bristle": d.coulomb / 4e-3, "bristle_coulomb": low, "bristle_static": low + d.coulomb * x,
                "bristle_speed": between(3, 7, r[0]), "bristle_damping": 1e-3 * d.coulomb / 0.03,
                "bristle_form": 1.0}  # fmt: skip
    # Instead of it.
    return {"coulomb": 0.0, "bristle": d.coulomb / (between(3e-3, 8e-3, r[1]) * min(1.0, 2 * x)),
            "bristle_coulomb": d.coulomb, "bristle_static": d.coulomb * (1 + x),
            "bristle_speed": between(3, 9, r[0])}  # fmt: skip


def bristles_expected(d: Drive, c: Changes) -> Expected:
    return {"coulomb_nm": c["bristle_coulomb"], "static_nm": c["bristle_static"],
            "stribeck_velocity_rad_per_s": c["bristle_speed"],
            "stiffness_nm_per_rad": c["bristle"]}  # fmt: skip


def ripple(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    order = (6.0, 10.0, 12.0)[int(2.999 * r[0])]
    found = {"ripple_a": 0.1 * d.coulomb * x, "ripple_a_order": order, "ripple_a_phase": phase(r[1])}
    if same:
        return found
    second = {
        "ripple_b": 0.5 * found["ripple_a"],
        "ripple_b_order": 2 * order,
        "ripple_b_phase": phase(r[2]),
    }
    return found | second | {"ripple_c": 0.35 * found["ripple_a"], "ripple_c_order": 4.0}


def ripple_expected(d: Drive, c: Changes) -> Expected:
    return {"components.0.order": c["ripple_a_order"], "components.0.cogging_nm": c["ripple_a"],
            "components.0.phase_deg": math.degrees(c["ripple_a_phase"])}  # fmt: skip


def load_friction(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    size = 0.05 * d.torques[0] * x
    viscous = between(0.3, 1.0, r[0]) * size * abs(d.ratio) / d.top_speed
    return {"load_coulomb": size, "load_viscous": viscous, "load_form": float(same)}  # fmt: skip


def hysteresis(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"maxwell": 0.05 * d.torques[0] * x, "maxwell_reach": between(0.6, 1.5, r[0]) * twist(d),
            "maxwell_form": float(same), "maxwell_power": 0.0}  # fmt: skip


def bouc_wen(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    size = 0.05 * d.torques[0] * x
    reach = between(0.15, 0.5, r[0]) * twist(d)
    return {"duhem": size, "duhem_stiffness": size / reach, "duhem_power": 1.0 if same else 2.0}


def backlash(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"gap": 1e-5 * x, "gap_rounding": 0.0 if same else 0.15}


def cubic(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"cubic": 0.02 * d.stiffness[0] / twist(d) ** 2 * x, "cubic_scale": 1.5 * twist(d),
            "cubic_form": float(same)}  # fmt: skip


def flexspline(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"flexspline": 0.05 / d.stiffness[0] * x, "flexspline_form": float(same),
            "flexspline_coefficient": between(0.5, 1.5, r[0]) / d.torques[0]}  # fmt: skip


def generator(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"generator": 0.05 / d.stiffness[0] * x, "generator_form": float(same),
            "generator_coefficient": between(0.5, 1.5, r[0]) * abs(d.ratio) / d.torques[0]}  # fmt: skip


def mount(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    compliance = 0.05 / d.stiffness[0] * x
    if same:
        return {"mount": compliance}
    speed = 2 * math.pi * between(60, 140, r[0])
    inertia = 1.0 / compliance / speed**2
    return {"mount": compliance, "mount_inertia": inertia, "mount_damping": 0.1 * inertia * speed}


def thermal(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    power = (d.coulomb + d.viscous * 1.5 * d.top_speed) * 1.5 * d.top_speed
    return {
        "thermal": 0.03 * x,
        "heat_capacity": between(0.7, 1.2, r[0]) * power,
        "thermal_form": float(same),
    }


def loss(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"extra_loss": 0.05 * x, "loss_form": float(same), "loss_scale": d.torques[0] / abs(d.ratio),
            "loss_power": between(1.15, 1.3, r[0])}  # fmt: skip


def unbalance(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"weight": 0.05 * d.torques[0] * x, "weight_phase": phase(r[0])}


def rotor(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    return {"motor_weight": 0.1 * d.coulomb * x, "motor_weight_phase": phase(r[0])}


def friction(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    power = 1.0 if same else between(0.75, 0.9, r[0])
    return {"extra_coulomb": d.coulomb * x, "extra_viscous": d.viscous * d.top_speed ** (1 - power) * x,
            "extra_power": power, "algebraic_sign": float(not same)}  # fmt: skip


def sensor_ripple(d: Drive, r: np.ndarray, x: float, same: bool) -> Changes:
    found = {"sensor_ripple": 0.01 * d.torques[0] * x, "sensor_order": 2.0 if r[0] < 0.5 else 4.0,
             "sensor_phase": phase(r[1])}  # fmt: skip
    return found if same else found | {"sensor_load": 0.3, "sensor_second": 0.3}


def degrees(name: str, phase: str, unit: float, field: str, angle: str, sign: float = 1.0):
    return lambda d, c: {field: c[name] / unit, angle: sign * math.degrees(c[phase])}
