"""What a scenario asks of its drive, by rigid bodies alone: torques, speeds and inertias beyond its size.

Before a run: what the run itself shows beyond a rating is an event of it (``hdsim.simulation.limits``).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hdsim.drive.ratings import ratings_of_preset

if TYPE_CHECKING:
    from hdsim.scenario.model import Scenario

#: Load inertia over that of motor and wave generator, seen from the output, beyond which a servo loop hardly
#: holds a load (estimate: makers of servo motors allow 5 to 30).
INERTIA_RATIO = 100.0
#: Momentary peak over rated torque of CSG gears, at most: 6.6 (size 14, ratio 50).
PEAK_OVER_RATED = 7.0


def demands(scenario: Scenario) -> list[str]:
    """Warnings, one line each: field, what it comes to, what the drive may carry."""
    return [*_speed(scenario), *_torque(scenario), *_inertia(scenario)]


def _motion(scenario: Scenario) -> tuple[str, float, float] | None:
    """Who commands the motion, and the largest speed (rad/s) and acceleration (rad/s^2) at the output."""
    command, ratio, end = scenario.command, scenario.drive.ratio, scenario.run.duration_s
    motor = command.motor
    if motor.type in ("position", "velocity"):
        sizes = motor.reference(ratio).largest(end)
        return "command.motor.trajectory", sizes[1 - motor.order], sizes[2 - motor.order]
    for motion in command.motions(ratio):
        _, speed, acceleration = motion.signal.largest(end)
        if speed > 0.0:
            scale = 1.0 / abs(ratio) if motion.axis == "motor" else 1.0
            return f"command.{motion.axis}.trajectory", scale * speed, scale * acceleration
    return None


def _speed(scenario: Scenario) -> list[str]:
    gear = ratings_of_preset(scenario.drive.preset)
    found = _motion(scenario)
    if found is None or gear is None or gear.maximum_input_speed is None:
        return []
    field, speed, _ = found
    output = speed * 30.0 / math.pi
    ratio, limit = abs(scenario.drive.ratio), gear.maximum_input_speed.value
    if ratio * output <= limit * (1.0 + 1e-9):
        return []
    return [
        f"{field}: found up to {output:,.0f} rpm at the output, so {ratio * output:,.0f} rpm at the wave "
        f"generator; {gear.name} may turn with {limit:g} rpm"
    ]


def _torque(scenario: Scenario) -> list[str]:
    load, gear = scenario.load, ratings_of_preset(scenario.drive.preset)
    motion = _motion(scenario)
    asked = {}
    if motion is not None:
        asked["load.inertia_kg_m2 times the commanded acceleration"] = load.inertia_kg_m2 * motion[2]
    if load.torque is not None:
        asked["load.torque"] = load.torque.data.largest(scenario.run.duration_s)[0]
    if load.gravity is not None:
        arm = load.gravity
        asked["load.gravity"] = arm.mass_kg * arm.gravity_m_per_s2 * arm.centre_of_mass_m
    largest, rated = sum(asked.values()), scenario.drive.rated_torque_nm
    peak = None if gear is None else gear.momentary_peak_torque
    limit, name = PEAK_OVER_RATED * rated, f"{PEAK_OVER_RATED:g} times the rated torque, a catalogue's peak,"
    if peak is not None and gear is not None:
        limit, name = peak.value, f"the momentary peak torque of {gear.name}"
    if largest <= limit:
        return []
    causes = " and ".join(name for name, torque in asked.items() if torque > 0.01 * largest)
    return [
        f"{causes}: found up to {largest:.4g} N m on the drive; {name} is {limit:.4g} N m, the rated one "
        f"{rated:g} N m"
    ]


def _inertia(scenario: Scenario) -> list[str]:
    drive, inertia = scenario.drive, scenario.load.inertia_kg_m2
    if scenario.command.motor.type == "locked":
        return []
    own = drive.ratio**2 * drive.inertia.rotor_kg_m2
    if inertia <= INERTIA_RATIO * own:
        return []
    swing = math.sqrt(drive.torsion.stiffness_k1_nm_per_rad / inertia) / (2.0 * math.pi)
    return [
        f"load.inertia_kg_m2: found {inertia:g}, {inertia / own:.3g} times that of motor and wave generator "
        f"seen from the output ({own:.3g}); on this drive it swings with {swing:.2g} Hz, motor held"
    ]
