"""The effects that are hidden in plants: where they can be seen, how large they are, what they are called."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import builders
import numpy as np
from builders import ARCMIN, Changes, Expected
from drives import GRAVITY, Drive

Builder = Callable[[Drive, np.ndarray, float, bool], Changes]

MOVING = ("swing", "moves", "chirp", "constant", "multisine")
ANY = (*MOVING, "locked")


@dataclass(frozen=True)
class Hidden:
    """An effect.

    Attributes:
        name: what it is called here; the catalogue's name where it has one.
        build: the plant's changes at a size.
        start: size at which sizing starts.
        most: largest size that is physical, ``limit`` says in words what that is.
        accepted: names of the catalogue that are right.
        motions: motions that excite it.
        arm: needs the weight of an arm.
        lacks: numbers that the base model must not have.
        seconds: least length of a record, s.
        speed: factor on the motion's speed.
        expected: fields that should be recovered when the formula is the catalogue's.
        temperature: is seen beside a measured temperature only.
    """

    name: str
    build: Builder
    start: float = 1.0
    most: float = 100.0
    limit: str = ""
    accepted: tuple[str, ...] = ()
    motions: tuple[str, ...] = MOVING
    arm: bool = False
    lacks: tuple[str, ...] = ()
    seconds: float = 0.0
    expected: Callable[[Drive, Changes], Expected] | None = None
    speed: float = 1.0
    temperature: bool = False


HYSTERESIS = ("torsional_hysteresis_duhem", "torsional_hysteresis_maxwell")
BY_TORQUE = ("swing", "moves", "chirp", "multisine", "locked")

EARLIER = (
    Hidden(
        "kinematic_error",
        builders.kinematic,
        most=90,
        limit="3 arcmin at order 2",
        expected=builders.kinematic_expected,
    ),
    Hidden(
        "wave_generator_eccentricity",
        builders.generator_once,
        most=90,
        limit="3 arcmin",
        expected=builders.degrees("wg_once", "wg_once_phase", 0.02e-3 / 25, "eccentricity_um", "phase_deg"),
    ),
    Hidden("damaged_tooth", builders.tooth, most=100, limit="3.4 arcmin", expected=builders.tooth_expected),
    Hidden(
        "output_eccentricity",
        lambda d, r, x, same: {"out_once": 1e-5 * x, "out_once_phase": builders.phase(r[0])},
        most=150,
        limit="5 arcmin",
        accepted=("output_eccentricity", "sensors"),
        expected=builders.degrees("out_once", "out_once_phase", 1e-3 / 25, "eccentricity_um", "phase_deg"),
    ),
    Hidden(
        "output encoder eccentricity",
        lambda d, r, x, same: {"encoder_once": 1e-5 * x, "encoder_phase": builders.phase(r[0])},
        most=150,
        limit="5 arcmin",
        accepted=("sensors", "output_eccentricity"),
        expected=builders.degrees(
            "encoder_once",
            "encoder_phase",
            ARCMIN,
            "output_angle.eccentricity_arcmin",
            "output_angle.eccentricity_phase_deg",
            -1.0,
        ),
    ),
    Hidden(
        "output encoder delay",
        lambda d, r, x, same: {"delay": 1e-4 * x},
        most=100,
        limit="10 ms",
        accepted=("sensors",),
        motions=("swing", "moves", "chirp", "multisine"),
        expected=lambda d, c: {"output_angle.delay_s": c["delay"]},
    ),
    Hidden(
        "torque-sensor ripple",
        builders.sensor_ripple,
        most=30,
        limit="0.3 T1",
        accepted=("sensors",),
        expected=lambda d, c: {
            "output_torque.ripple.0.order": c["sensor_order"],
            "output_torque.ripple.0.amplitude_nm": c["sensor_ripple"],
            "output_torque.ripple.0.phase_deg": math.degrees(c["sensor_phase"]),
        },
    ),
    Hidden(
        "stribeck_friction",
        builders.stribeck,
        most=4,
        limit="4 times the Coulomb friction",
        expected=lambda d, c: {
            "extra_static_nm": c["stribeck"],
            "stribeck_velocity_rad_per_s": c["stribeck_speed"],
        },
    ),
    Hidden(
        "lugre_friction",
        builders.bristles,
        most=3,
        limit="3 times the Coulomb friction",
        motions=ANY,
        expected=builders.bristles_expected,
    ),
    Hidden(
        "motor_torque_ripple",
        builders.ripple,
        most=40,
        limit="4 times the Coulomb friction",
        expected=builders.ripple_expected,
    ),
    Hidden(
        "load_side_friction",
        builders.load_friction,
        most=20,
        limit="T1 of the spring",
        expected=lambda d, c: {"coulomb_nm": c["load_coulomb"], "viscous_nm_s_per_rad": c["load_viscous"]},
    ),
    Hidden(
        "torsional_hysteresis_maxwell",
        builders.hysteresis,
        most=10,
        limit="0.5 T1",
        accepted=HYSTERESIS,
        motions=BY_TORQUE,
        arm=True,
        expected=lambda d, c: {"slip_torque_nm": c["maxwell"]},
    ),
    Hidden(
        "torsional_hysteresis_duhem",
        builders.bouc_wen,
        most=10,
        limit="0.5 T1",
        accepted=HYSTERESIS,
        motions=BY_TORQUE,
        arm=True,
        expected=lambda d, c: {
            "saturation_torque_nm": c["duhem"],
            "saturation_twist_mrad": 1e3 * c["duhem"] / c["duhem_stiffness"],
        },
    ),
    Hidden(
        "output_backlash",
        builders.backlash,
        most=90,
        limit="3 arcmin",
        motions=BY_TORQUE,
        expected=lambda d, c: {"backlash_arcmin": c["gap"] / ARCMIN},
    ),
    Hidden(
        "stiffness_nonlinearity",
        builders.cubic,
        most=60,
        limit="1.2 K1 at the twist of T1",
        motions=BY_TORQUE,
        arm=True,
        expected=lambda d, c: {"cubic_nm_per_rad3": c["cubic"]},
    ),
    Hidden(
        "flexspline_stiffening",
        builders.flexspline,
        most=60,
        limit="compliance 3 / K1",
        motions=BY_TORQUE,
        arm=True,
        expected=lambda d, c: {
            "stiffness_nm_per_rad": 1 / c["flexspline"],
            "coefficient_per_nm": c["flexspline_coefficient"],
        },
    ),
    Hidden(
        "wave_generator_compliance",
        builders.generator,
        most=60,
        limit="compliance 3 / K1",
        motions=BY_TORQUE,
        arm=True,
        expected=lambda d, c: {
            "stiffness_nm_per_rad": 1 / (c["generator"] * d.ratio**2),
            "coefficient_per_nm": c["generator_coefficient"],
        },
    ),
    Hidden(
        "base_flexibility",
        builders.mount,
        most=40,
        limit="compliance 2 / K1",
        motions=("swing", "moves", "chirp", "multisine"),
        arm=True,
        expected=lambda d, c: {"stiffness_nm_per_rad": 1 / c["mount"]},
    ),
    Hidden(
        "thermal_friction",
        builders.thermal,
        most=5,
        limit="0.15 per kelvin",
        motions=("swing", "moves", "constant", "multisine"),
        seconds=20.0,
        speed=3.0,
        expected=lambda d, c: {
            "viscosity_coefficient_per_k": c["thermal"],
            "heat_capacity_j_per_k": c["heat_capacity"],
        },
    ),
    Hidden(
        "load_dependent_loss",
        builders.loss,
        most=4,
        limit="0.2 of the torque",
        arm=True,
        lacks=("load_loss",),
        expected=lambda d, c: {"coefficient": c["extra_loss"]},
    ),
    Hidden(
        "unbalance",
        builders.unbalance,
        most=40,
        limit="2 T1",
        expected=builders.degrees("weight", "weight_phase", GRAVITY, "output_kg_m", "output_phase_deg"),
    ),
    Hidden(
        "unbalance of the rotor",
        builders.rotor,
        most=40,
        limit="4 times the Coulomb friction",
        accepted=("unbalance",),
        expected=builders.degrees(
            "motor_weight", "motor_weight_phase", GRAVITY, "motor_kg_m", "motor_phase_deg"
        ),
    ),
    Hidden(
        "input_coulomb_viscous",
        builders.friction,
        most=3,
        limit="3 times the size's Coulomb and viscous friction",
        lacks=("coulomb", "viscous"),
        expected=lambda d, c: {"coulomb_nm": c["extra_coulomb"], "viscous_nm_s_per_rad": c["extra_viscous"]},
    ),
)

#: They have their turns after the others, and are in no pair: earlier keys draw what they have always drawn.
LATER = (
    Hidden(
        "load_dependent_kinematic_error",
        builders.uneven,
        most=40,
        limit="0.2 K1",
        motions=("swing", "moves", "chirp", "multisine"),
        arm=True,
        expected=builders.uneven_expected,
    ),
    Hidden(
        "position_dependent_friction",
        builders.lumpy,
        most=40,
        limit="twice the Coulomb friction",
        expected=builders.lumpy_expected,
    ),
    Hidden(
        "thermal_stiffness",
        builders.warm,
        most=20,
        limit="0.01 per kelvin",
        motions=("swing", "moves", "multisine"),
        arm=True,
        seconds=20.0,
        speed=3.0,
        temperature=True,
        expected=lambda d, c: {"stiffness_coefficient_per_k": c["warm"]},
    ),
    Hidden(
        "wave_generator_bearing",
        builders.ball,
        most=40,
        limit="twice the Coulomb friction",
        motions=("swing", "moves", "constant", "multisine"),
        seconds=15.0,
        speed=3.0,
        expected=builders.ball_expected,
    ),
)
EFFECTS = (*EARLIER, *LATER)

#: Effects of one kind can look alike; the two of a pair are of different kinds.
KINDS_OF = (
    frozenset({"kinematic_error", "wave_generator_eccentricity", "damaged_tooth", "output_eccentricity",
               "output encoder eccentricity", "output encoder delay", "load_dependent_kinematic_error"}),
    frozenset({"stribeck_friction", "lugre_friction", "load_side_friction", "input_coulomb_viscous",
               "thermal_friction", "load_dependent_loss", "position_dependent_friction",
               "wave_generator_bearing"}),
    frozenset({"torsional_hysteresis_maxwell", "torsional_hysteresis_duhem", "output_backlash",
               "stiffness_nonlinearity", "flexspline_stiffening", "wave_generator_compliance",
               "base_flexibility", "thermal_stiffness"}),
    frozenset({"motor_torque_ripple", "unbalance", "unbalance of the rotor", "torque-sensor ripple"}),
)  # fmt: skip
