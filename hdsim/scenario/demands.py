"""What a scenario asks of its drive, by rigid bodies alone: torques, speeds and inertias no gear of its size has.

Before a run: what the run itself shows beyond a rating is an event of it (``hdsim.simulation.limits``).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hdsim.drive.ratings import ratings_of_preset

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hdsim.scenario.model import Scenario

    Array = NDArray[np.float64]

#: Load inertia over that of motor and wave generator, seen from the output, beyond which a servo loop hardly
#: holds a load (estimate: makers of servo motors allow 5 to 30).
INERTIA_RATIO = 100.0
#: Momentary peak over rated torque of CSG gears, at most: 6.6 (size 14, ratio 50).
PEAK_OVER_RATED = 7.0
#: Times at which a commanded motion is looked at.
POINTS = 4001


def demands(scenario: Scenario) -> list[str]:
    """Warnings, one line each: field, what it comes to, what the drive may carry."""
    return [*_speed(scenario), *_torque(scenario), *_inertia(scenario)]


def _motion(scenario: Scenario, times: Array) -> tuple[str, Array, Array] | None:
    """Who commands the motion, and its speed (rad/s) and acceleration (rad/s^2) at the output."""
    command, ratio = scenario.command, scenario.drive.ratio
    motor = command.motor
    if motor.type in ("position", "velocity"):
        values = motor.reference(ratio).values(times)
        first = 1 - motor.order
        return "command.motor.trajectory", values[first], values[first + 1]
    for motion in command.motions(ratio):
        values = motion.signal.values(times)
        if values[1].any():
            scale = 1.0 / ratio if motion.axis == "motor" else 1.0
            return f"command.{motion.axis}.trajectory", scale * values[1], scale * values[2]
    return None


def _times(scenario: Scenario) -> Array:
    import numpy as np

    return np.linspace(0.0, scenario.run.duration_s, POINTS)


def _speed(scenario: Scenario) -> list[str]:
    gear = ratings_of_preset(scenario.drive.preset)
    found = _motion(scenario, _times(scenario))
    if found is None or gear is None or gear.maximum_input_speed is None:
        return []
    field, speed, _ = found
    output = float(abs(speed).max()) * 30.0 / math.pi
    ratio, limit = abs(scenario.drive.ratio), gear.maximum_input_speed.value
    if ratio * output <= limit:
        return []
    return [
        f"{field}: found up to {output:.4g} rpm at the output, so {ratio * output:.4g} rpm at the wave "
        f"generator; {gear.name} may turn with {limit:g} rpm"
    ]


def _torque(scenario: Scenario) -> list[str]:
    import numpy as np

    load, gear = scenario.load, ratings_of_preset(scenario.drive.preset)
    times = _times(scenario)
    motion = _motion(scenario, times)
    asked = np.zeros(len(times))
    causes = []
    if motion is not None:
        asked += load.inertia_kg_m2 * motion[2]
        causes.append("load.inertia_kg_m2 times the commanded acceleration")
    if load.torque is not None:
        asked -= load.torque.values(times)[0]
        causes.append("load.torque")
    largest = float(np.max(np.abs(asked)))
    if load.gravity is not None:
        arm = load.gravity
        largest += arm.mass_kg * arm.gravity_m_per_s2 * arm.centre_of_mass_m
        causes.append("load.gravity")
    rated = scenario.drive.rated_torque_nm
    peak = None if gear is None else gear.momentary_peak_torque or gear.repeated_peak_torque
    limit, name = (PEAK_OVER_RATED * rated, f"{PEAK_OVER_RATED:g} times the rated torque, a catalogue's peak,")
    if peak is not None and gear is not None:
        limit = peak.value
        name = f"the momentary peak torque of {gear.name}" if gear.momentary_peak_torque else "its peak torque"
    if largest <= limit:
        return []
    return [
        f"{' and '.join(causes)}: found up to {largest:.4g} N m on the drive; {name} is {limit:.4g} N m, the "
        f"rated one {rated:g} N m"
    ]


def _inertia(scenario: Scenario) -> list[str]:
    drive, inertia = scenario.drive, scenario.load.inertia_kg_m2
    if scenario.command.motor.type == "locked":
        return []
    own = drive.ratio**2 * (drive.inertia.motor_kg_m2 + drive.inertia.wave_generator_kg_m2)
    if inertia <= INERTIA_RATIO * own:
        return []
    swing = math.sqrt(drive.torsion.stiffness_k1_nm_per_rad / inertia) / (2.0 * math.pi)
    return [
        f"load.inertia_kg_m2: found {inertia:g}, {inertia / own:.3g} times that of motor and wave generator "
        f"seen from the output ({own:.3g}); on this drive it swings with {swing:.2g} Hz, motor held"
    ]
