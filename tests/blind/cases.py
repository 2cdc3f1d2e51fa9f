"""The blind matrix: which plants, how strong, and what counts as right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from plants import Case, Sensors, truth

#: Size of an effect's trace over the channel's noise, in the channel where it is strongest.
STRENGTHS = {"clear": 5.0, "fair": 2.0, "faint": 0.7}

#: Plants of each effect at a size that is scaled afterwards: truth, numbers, and the number that scales.
EFFECTS: dict[str, tuple[dict[str, float], tuple[str, ...]]] = {
    "kinematic_error": (
        {"ke_order": 2.0, "ke_amplitude": 4e-5, "ke_phase": 1.0, "ke_order2": 2.0, "ke_amplitude2": 2e-5},
        ("ke_amplitude", "ke_amplitude2"),
    ),
    "wave_generator_eccentricity": ({"wg_once": 2e-5}, ("wg_once",)),
    "stribeck_friction": ({"stribeck_extra": 0.02, "stribeck_speed": 6.0}, ("stribeck_extra",)),
    "lugre_friction": (
        {"lugre_static": 0.06, "lugre_stiffness": 6.0, "lugre_speed": 5.0}, ("lugre_static",),
    ),
    "motor_torque_ripple": (
        {"ripple_order": 12.0, "ripple_torque": 0.01, "ripple_phase": 0.6}, ("ripple_torque",),
    ),
    "load_side_friction": ({"load_coulomb": 1.0, "load_viscous": 0.8}, ("load_coulomb", "load_viscous")),
    "torsional_hysteresis": ({"maxwell_torque": 1.0, "maxwell_scale": 6e-4}, ("maxwell_torque",)),
    "output_backlash": ({"gap": 2e-5}, ("gap",)),
    "stiffness_nonlinearity": ({"cubic": 3e9}, ("cubic",)),
    "unbalance": ({"unbalance": 1.0, "unbalance_phase": 0.9}, ("unbalance",)),
    "output_eccentricity": ({"encoder_once": 2e-5, "encoder_phase": 0.8}, ("encoder_once",)),
    "delay": ({"delay": 1e-4}, ("delay",)),
    "torque_sensor_ripple": ({"sensor_order": 2.0, "sensor_ripple": 0.3}, ("sensor_ripple",)),
}  # fmt: skip
#: Names that count as right for a truth, where it isn't one name of the catalogue.
ACCEPTED = {
    "torsional_hysteresis": {"torsional_hysteresis_duhem", "torsional_hysteresis_maxwell"},
    "delay": {"sensors"},
    "torque_sensor_ripple": {"sensors"},
    "output_eccentricity": {"sensors", "output_eccentricity"},
}
OUTSIDE: dict[str, dict[str, float]] = {
    "spring catch": {"spring_kick": 3.0},
    "cable": {"cable": 4.0},
    "drifting torque": {"drift": 0.04},
}
PARAMETERS: dict[str, dict[str, float]] = {
    "load inertia +20 %": {"load_inertia": 0.6},
    "motor inertia +30 %": {"motor_inertia": 9.0e-5},
    "stiffness -15 %": {"k1": 1.36e4, "k2": 2.125e4, "k3": 2.465e4},
    "Coulomb friction +30 %": {"coulomb": 0.039},
    "viscous friction -30 %": {"viscous": 2.45e-4},
    "torque constant +10 %": {"gain": 1.1},
}
PAIRS = (("kinematic_error", "stribeck_friction"), ("motor_torque_ripple", "load_side_friction"))


@dataclass(frozen=True)
class Trial:
    """A case, its group and what counts as right."""

    group: str
    case: Case
    accepted: tuple[frozenset[str], ...] = ()
    friction_free_base: bool = False


def trials(seeds: int) -> Iterator[Trial]:
    """The matrix over ``seeds`` seeds."""
    for seed in range(seeds):
        sensors = Sensors()
        yield Trial("null", Case("nothing", seed=seed))
        yield Trial("null", Case("nothing, dirty", {}, replace(sensors, spikes=25, jitter=2e-4), seed=seed))
        for name, changes in PARAMETERS.items():
            yield Trial("parameter", Case(name, changes, seed=seed))
        for strength, multiple in STRENGTHS.items():
            for name in EFFECTS:
                yield Trial(strength, Case(name, sized(name, multiple), seed=seed), (accepted(name),))
        yield Trial(
            "clear", Case("input_coulomb_viscous", seed=seed), (accepted("input_coulomb_viscous"),), True
        )
        for first, second in PAIRS:
            both = sized(first, 4.0) | sized(second, 4.0)
            yield Trial(
                "pair", Case(f"{first} + {second}", both, seed=seed), (accepted(first), accepted(second))
            )
        for name, changes in OUTSIDE.items():
            yield Trial("outside", Case(name, changes, seed=seed))


def accepted(name: str) -> frozenset[str]:
    """Names that count as right."""
    return frozenset(ACCEPTED.get(name, {name}))


_UNITS: dict[str, float] = {}


def sized(name: str, multiple: float) -> dict[str, float]:
    """The plant's numbers that make the effect's largest trace ``multiple`` times its channel's noise."""
    changes, scaling = EFFECTS[name]
    if name not in _UNITS:
        _UNITS[name] = _trace(changes)
    factor = multiple / _UNITS[name]
    scaled = {key: value * factor if key in scaling else value for key, value in changes.items()}
    if name == "lugre_friction":
        scaled["lugre_static"] = 0.03 + (changes["lugre_static"] - 0.03) * factor
    return scaled


def _trace(changes: dict[str, float]) -> float:
    """Root-mean-square change of a channel over its noise, the largest over the channels."""
    sensors = Sensors()
    with_it, without = (truth(Case("", c)) for c in (changes, {}))
    ideal = [
        np.column_stack([log[:, 1], log[:, 2] - log[:, 0] / -100.0, log[:, 3]]) for log in (with_it, without)
    ]
    change = ideal[0] - ideal[1]
    if "delay" in changes:
        change[:, 1] += changes["delay"] * np.gradient(without[:, 2], 1e-3)
    if "encoder_once" in changes:
        change[:, 1] += changes["encoder_once"] * np.sin(without[:, 2] + changes["encoder_phase"])
    if "sensor_ripple" in changes:
        change[:, 2] += changes["sensor_ripple"] * np.sin(changes["sensor_order"] * without[:, 0])
    noise = np.array([sensors.motor_torque_noise, sensors.output_noise, sensors.output_torque_noise])
    spread: np.ndarray = change.std(axis=0) / noise
    return float(spread.max())
