"""What is hidden in the MuJoCo plants: numbers by size, where it can be seen, and which names are right."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drawing import GRAVITY, Drive
from moving import MOTIONS

Changes = dict[str, float]
Builder = Callable[[Drive, Sequence[float], float, bool], Changes]

ARCMIN = math.pi / 10800
TURN = 2 * math.pi
FRICTION = ("motor_torque",)
OUTPUT = ("output_angle",)
SWINGS = ("multisine", "moves", "sweep")


@dataclass(frozen=True)
class Hidden:
    """Something hidden.

    Attributes:
        name: what it is called here; the catalogue's name where it has one.
        build: the plant's changes from drive, uniform draws, size (1: plain to see with usual sensors), and
            whether the formula is the catalogue's.
        most: largest size that is physical.
        accepted: names of the catalogue that are right.
        channels: channels that it needs.
        motions: motions that excite it.
        loaded: needs an arm's weight or an external torque.
        rigid: can be hidden in a rigid drive.
        lacks: numbers of the friction that the base must not have.
        fast: needs a log of 500 Hz or more.
        seconds: least length of a record, s.
        speed: factor on the motions' speed.
        numbers: true values by field, where the formula is the catalogue's.
    """

    name: str
    build: Builder
    most: float = 100.0
    accepted: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    motions: tuple[str, ...] = MOTIONS
    loaded: bool = False
    rigid: bool = False
    lacks: tuple[str, ...] = ()
    fast: bool = False
    seconds: float = 0.0
    speed: float = 1.0
    numbers: Callable[[Drive, Changes], dict[str, float]] | None = None


def _twist(d: Drive) -> float:
    return d.torques[0] / d.stiffness[0]


def kinematic(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    a = 3e-5 * x
    found = {
        "ke_2": a,
        "ke_2_phase": TURN * r[0],
        "ke_rel": (0.3 + 0.6 * r[1]) * a,
        "ke_rel_phase": TURN * r[2],
        "ke_4": 0.3 * a,
        "ke_4_phase": TURN * r[3],
    }
    return found if same else found | {"ke_1": 0.35 * a, "ke_1_phase": TURN * r[4]}


def kinematic_numbers(d: Drive, c: Changes) -> dict[str, float]:
    return {
        f"components.{k}.amplitude_arcmin": c[name] / ARCMIN
        for k, name in enumerate(("ke_2", "ke_rel", "ke_4"))
    }


def dent(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    return {"dent": -5e-5 * x, "dent_at": math.pi * r[0], "dent_width": 0.12 + 0.15 * r[1]}


def dent_numbers(d: Drive, c: Changes) -> dict[str, float]:
    return {"amplitude_arcmin": c["dent"] / ARCMIN, "width_deg": math.degrees(c["dent_width"])}


def stribeck(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    return {
        "stribeck": 0.3 * d.coulomb * x,
        "stribeck_speed": 3.0 + 6.0 * r[0],
        "stribeck_power": 2.0 if same else 1.0,
    }


def bristles(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    found = {"bristle": d.coulomb / (3e-3 + 5e-3 * r[0]), "bristle_speed": 3.0 + 5.0 * r[1],
             "bristle_damping": 0.02 * d.coulomb}  # fmt: skip
    if same:
        # On top of the drive's own.
        low = 0.3 * d.coulomb * x
        return found | {"bristle_coulomb": low, "bristle_static": low + 0.3 * d.coulomb * x}
    return found | {"coulomb": 0.0, "bristle_coulomb": d.coulomb, "bristle_static": d.coulomb * (1 + 0.3 * x)}


def friction(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    power = 1.0 if same else 0.7 + 0.2 * r[0]
    return {
        "extra_coulomb": d.coulomb * x,
        "extra_viscous": d.viscous * d.top_speed ** (1 - power) * x,
        "extra_power": power,
    }


def loss(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    return {"driving_loss": 0.05 * x, "backdriving_loss": (1.0 if same else 0.3 + 0.4 * r[0]) * 0.05 * x}


def thermal(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    power = (d.coulomb + 0.4 * d.viscous * d.top_speed) * 0.4 * d.top_speed
    return {"thermal": 0.02 * x, "thermal_offset": 0.0 if same else 95.0,
            "heat_capacity": (0.12 + 0.2 * r[0]) * power, "heat_resistance": 40.0 / power}  # fmt: skip


def hysteresis(spread: float) -> Builder:
    def build(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
        twist = (0.15 + 0.35 * r[0] if same else 0.5 + 0.5 * r[0]) * _twist(d)
        return {"slip": 0.1 * d.torques[0] * x, "slip_twist": twist, "slip_spread": spread}

    return build


def ripple(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    order = (6.0, 8.0, 12.0)[int(2.999 * r[0])]
    found = {"cogging": 0.15 * d.coulomb * x, "cogging_order": order, "cogging_phase": TURN * r[1]}
    return found if same else found | {"cogging_2": 0.06 * d.coulomb * x, "cogging_2_order": 2 * order,
                                       "cogging_2_phase": TURN * r[2]}  # fmt: skip


def output_friction(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    size = 0.1 * d.torques[0] * x
    viscous = (0.3 + 0.7 * r[0]) * size * abs(d.ratio) / d.top_speed
    return {"output_coulomb" if same else "output_dry": size, "output_viscous": viscous}


def sensor_ripple(d: Drive, r: Sequence[float], x: float, same: bool) -> Changes:
    return {"sensor_ripple": 0.03 * d.torques[0] * x, "sensor_order": 2.0 if r[0] < 0.5 else 4.0,
            "sensor_phase": TURN * r[1], "sensor_second": 0.0 if same else 0.4}  # fmt: skip


HYSTERESIS = ("torsional_hysteresis_duhem", "torsional_hysteresis_maxwell")
ECCENTRIC = ("output_eccentricity", "sensors")

EFFECTS = (
    Hidden("kinematic_error", kinematic, channels=OUTPUT, most=40, numbers=kinematic_numbers),
    Hidden(
        "stribeck_friction",
        stribeck,
        most=6,
        rigid=True,
        numbers=lambda d, c: {
            "extra_static_nm": c["stribeck"],
            "stribeck_velocity_rad_per_s": c["stribeck_speed"],
        },
    ),
    Hidden(
        "output_backlash",
        lambda d, r, x, same: {"gap": 4e-5 * x},
        channels=OUTPUT,
        most=40,
        numbers=lambda d, c: {"backlash_arcmin": c["gap"] / ARCMIN},
    ),
    Hidden(
        "motor_torque_ripple",
        ripple,
        rigid=True,
        most=40,
        fast=True,
        numbers=lambda d, c: {
            "components.0.order": c["cogging_order"],
            "components.0.cogging_nm": c["cogging"],
        },
    ),
    Hidden(
        "torsional_hysteresis_duhem",
        hysteresis(0.0),
        channels=OUTPUT,
        accepted=HYSTERESIS,
        loaded=True,
        most=10,
        motions=SWINGS,
        numbers=lambda d, c: {
            "saturation_torque_nm": c["slip"],
            "saturation_twist_mrad": 1e3 * c["slip_twist"],
        },
    ),
    Hidden(
        "input_coulomb_viscous",
        friction,
        lacks=("coulomb", "viscous"),
        rigid=True,
        most=3,
        numbers=lambda d, c: {"coulomb_nm": c["extra_coulomb"], "viscous_nm_s_per_rad": c["extra_viscous"]},
    ),
    Hidden(
        "output encoder eccentricity",
        lambda d, r, x, same: {"encoder_once": 4e-5 * x, "encoder_phase": TURN * r[0]},
        channels=OUTPUT,
        accepted=ECCENTRIC,
        rigid=True,
        numbers=lambda d, c: {"output_angle.eccentricity_arcmin": c["encoder_once"] / ARCMIN},
    ),
    Hidden(
        "load_side_friction",
        output_friction,
        rigid=True,
        most=10,
        numbers=lambda d, c: {"coulomb_nm": c["output_coulomb"], "viscous_nm_s_per_rad": c["output_viscous"]},
    ),
    Hidden(
        "unbalance",
        lambda d, r, x, same: {"unbalance": 0.1 * d.torques[0] / GRAVITY * x, "unbalance_phase": TURN * r[0]},
        rigid=True,
        most=10,
        numbers=lambda d, c: {"output_kg_m": c["unbalance"]},
    ),
    Hidden(
        "lugre_friction",
        bristles,
        rigid=True,
        most=4,
        motions=("multisine", "moves", "creep"),
        numbers=lambda d, c: {"coulomb_nm": c["bristle_coulomb"], "static_nm": c["bristle_static"]},
    ),
    Hidden(
        "torque-sensor ripple",
        sensor_ripple,
        channels=("output_torque",),
        accepted=("sensors",),
        rigid=True,
        numbers=lambda d, c: {"output_torque.ripple.0.amplitude_nm": c["sensor_ripple"]},
    ),
    Hidden(
        "stiffness_nonlinearity",
        lambda d, r, x, same: {"cubic": 0.05 * d.stiffness[0] / _twist(d) ** 2 * x},
        channels=OUTPUT,
        loaded=True,
        most=30,
        motions=SWINGS,
        numbers=lambda d, c: {"cubic_nm_per_rad3": c["cubic"]},
    ),
    Hidden(
        "load_dependent_loss",
        loss,
        lacks=("load_loss",),
        loaded=True,
        rigid=True,
        most=6,
        numbers=lambda d, c: {"coefficient": c["driving_loss"]},
    ),
    Hidden(
        "torsional_hysteresis_maxwell",
        hysteresis(0.9),
        channels=OUTPUT,
        accepted=HYSTERESIS,
        loaded=True,
        most=10,
        motions=SWINGS,
    ),
    Hidden(
        "thermal_friction",
        thermal,
        rigid=True,
        most=5,
        seconds=15.0,
        fast=True,
        speed=3.0,
        motions=("multisine", "moves", "plateaus"),
    ),
    Hidden(
        "wave_generator_eccentricity",
        lambda d, r, x, same: (
            {"ke_1": 3e-5 * x, "ke_1_phase": TURN * r[0]} | ({} if same else {"ke_2": 0.3e-5 * x})
        ),
        channels=OUTPUT,
        most=40,
    ),
    Hidden(
        "unbalance of the rotor",
        lambda d, r, x, same: {
            "rotor_unbalance": 0.2 * d.coulomb / GRAVITY * x,
            "rotor_unbalance_phase": TURN * r[0],
        },
        accepted=("unbalance",),
        rigid=True,
        most=4,
        numbers=lambda d, c: {"motor_kg_m": c["rotor_unbalance"]},
    ),
    Hidden("damaged_tooth", dent, channels=OUTPUT, most=40, numbers=dent_numbers),
    Hidden(
        "output_eccentricity",
        lambda d, r, x, same: {"ke_out": 4e-5 * x, "ke_out_phase": TURN * r[0]},
        channels=OUTPUT,
        accepted=ECCENTRIC,
    ),
    Hidden(
        "output encoder delay",
        lambda d, r, x, same: {"delay": 3e-4 * x},
        channels=OUTPUT,
        accepted=("sensors",),
        rigid=True,
        most=20,
        motions=SWINGS,
        numbers=lambda d, c: {"output_angle.delay_s": c["delay"]},
    ),
)

PAIRS = (
    ("kinematic_error", "stribeck_friction"),
    ("output_backlash", "load_side_friction"),
    ("motor_torque_ripple", "kinematic_error"),
    ("torsional_hysteresis_duhem", "kinematic_error"),
    ("lugre_friction", "wave_generator_eccentricity"),
    ("unbalance", "input_coulomb_viscous"),
    ("torque-sensor ripple", "stribeck_friction"),
    ("load_dependent_loss", "output encoder eccentricity"),
)
