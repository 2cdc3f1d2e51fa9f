"""The causes of error that a scenario has, and how each is switched off."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hdsim.actuation.loads import Load

if TYPE_CHECKING:
    from hdsim.scenario.model import Scenario

_KINEMATIC = ("kinematic_error", "wave_generator_eccentricity", "output_eccentricity", "damaged_tooth")
_HYSTERESIS = ("torsional_hysteresis_maxwell", "torsional_hysteresis_duhem")
_FRICTION = (
    "input_coulomb_viscous", "nonlinear_viscous_friction", "stribeck_friction", "lugre_friction",
    "load_dependent_loss", "load_side_friction", "thermal_friction", "motor_torque_ripple",
    "resonant_torque_ripple",
)  # fmt: skip
#: Damping, as a share of the critical, of the load on the drive once no controller damps it.
_DAMPING = 0.2
#: Parameters of the drive that are friction of its input.
_DRIVE_FRICTION = ("coulomb_nm", "viscous_nm_s_per_rad", "load_coefficient")


@dataclass(frozen=True)
class Cause:
    """A cause of error that can be switched off.

    Args:
        name: in tables.
        title: for people.
        switched: what "off" means.
        effects: effects that are off with it.
        change: what else is changed in the scenario's data.
    """

    name: str
    title: str
    switched: str
    effects: tuple[str, ...] = ()
    change: Callable[[dict[str, Any]], object] | None = None


def _inertia(data: dict[str, Any]) -> float:
    """Moment of inertia on the output, that of an arm as it begins included, kg m^2."""
    return Load.model_validate(data["load"]).over(0.0)[1]


def _no_load(data: dict[str, Any]) -> None:
    data["load"] |= {"inertia_kg_m2": _inertia(data), "torque": None, "gravity": None, "arm": None}


def _no_friction(data: dict[str, Any]) -> None:
    motor = data["command"]["motor"]
    if motor["type"] == "position":
        # A motor on its commanded path needs no controller, and no friction moves it off.
        data["command"]["motor"] = {"type": "motion", "trajectory": motor["trajectory"], "at": motor["at"]}
        # The controller also damped the load's vibration. Damping changes nothing at rest.
        torsion = data["drive"]["torsion"]
        critical = 2.0 * math.sqrt(torsion["stiffness_k3_nm_per_rad"] * _inertia(data))
        torsion["damping_nm_s_per_rad"] = max(torsion["damping_nm_s_per_rad"], _DAMPING * critical)
    else:
        for name in _DRIVE_FRICTION:
            data["drive"]["friction"][name] = 0.0


def causes(scenario: Scenario) -> tuple[Cause, ...]:
    """The causes that a scenario has."""
    from hdsim.effects import catalogue

    on = set(scenario.effects.active())
    mesh = scenario.drive.mesh
    toothed = mesh.model in ("teeth", "tabulated")
    found: list[Cause] = []

    def group(names: Sequence[str]) -> tuple[str, ...]:
        return tuple(name for name in names if name in on)

    if toothed and getattr(mesh, "half_gap_m", None) != 0:
        title = "tooth backlash" if getattr(mesh, "half_gap_m", None) is not None else "W-M tooth backlash"
        found.append(Cause("backlash", title, "gaps between the flanks closed, stiffness kept"))
    pitch = toothed and getattr(mesh, "pitch_error_m", 0.0) > 0
    if group(_KINEMATIC) or pitch:
        names = [
            *(name.replace("_", " ") for name in group(_KINEMATIC)),
            *(["pitch errors"] if pitch else []),
        ]
        found.append(
            Cause("kinematic_error", "kinematic error", " and ".join(names) + " off", group(_KINEMATIC))
        )
    if any(part is not None for part in (scenario.load.torque, scenario.load.gravity, scenario.load.arm)):
        found.append(Cause("wind_up", "wind-up under load", "load torque and weight off", (), _no_load))
    if group(_HYSTERESIS):
        found.append(Cause("hysteresis", "hysteresis", "torsional hysteresis off", group(_HYSTERESIS)))
    motor = scenario.command.motor.type
    friction = scenario.drive.friction
    if motor == "position":
        found.append(
            Cause(
                "friction_and_control", "friction and control",
                "motor follows its commanded path exactly", group(_FRICTION), _no_friction,
            )
        )  # fmt: skip
    elif motor not in ("motion", "locked") and (
        group(_FRICTION) or any(getattr(friction, name) > 0 for name in _DRIVE_FRICTION)
    ):
        found.append(Cause("friction", "friction", "all friction off", group(_FRICTION), _no_friction))
    elif group(_FRICTION):
        found.append(Cause("friction", "friction", "friction effects off", group(_FRICTION)))
    if "sensors" in on:
        found.append(Cause("encoder", "encoder", "sensors read the truth", ("sensors",)))
    taken = {name for cause in found for name in cause.effects}
    known = catalogue()
    found += [
        Cause(name, known[name].title, f"{name.replace('_', ' ')} off", (name,))
        for name in sorted(on - taken)
    ]
    return tuple(found)
