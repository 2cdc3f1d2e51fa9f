"""What a valid scenario asks for that its author hardly means: one line each, at ``check`` and ``run``."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING

from hdsim.scenario.demands import demands

if TYPE_CHECKING:
    from hdsim.scenario.model import Scenario


def doubts(scenario: Scenario) -> list[str]:
    """Warnings about a scenario, each one line: field, what was found, what to do."""
    return [
        *demands(scenario),
        *_unread_sensors(scenario),
        *_coarse_windows(scenario),
        *_double_friction(scenario),
    ]


def _unread_sensors(scenario: Scenario) -> list[str]:
    """A continuous controller sees the true motion."""
    motor = scenario.command.motor
    sensors = scenario.effects.active().get("sensors")
    if sensors is None or not hasattr(motor, "sample_period_s") or motor.sample_period_s is not None:
        return []
    given = [
        name
        for name in ("motor_angle", "motor_velocity", "output_angle", "output_velocity")
        if getattr(sensors, name) is not None
    ]
    if not given:
        return []
    return [
        f"effects.sensors: found {', '.join(given)} beside a continuous controller, which reads the true "
        "motion: they only show in the log; set command.motor.sample_period_s for one that reads them"
    ]


def _coarse_windows(scenario: Scenario) -> list[str]:
    """A speed window within one sample of a run is read off a line between two samples."""
    sensors = scenario.effects.active().get("sensors")
    if sensors is None or getattr(scenario.command.motor, "sample_period_s", None) is not None:
        return []
    rate = scenario.run.sample_rate_hz
    found = []
    for name in ("motor_velocity", "output_velocity"):
        sensor = getattr(sensors, name)
        if sensor is not None and sensor.method == "differenced" and sensor.window_s * rate < 1.0 - 1e-9:
            found.append(
                f"effects.sensors.{name}.window_s: found {sensor.window_s:g} s, but run.sample_rate_hz of "
                f"{rate:g} keeps the angle every {1 / rate:g} s: faster changes of speed read too small; "
                f"take at least {1 / sensor.window_s:g} Hz"
            )
    return found


def _double_friction(scenario: Scenario) -> list[str]:
    """Effects whose numbers add to the drive's, which a preset brings."""
    found = []
    for name, effect in scenario.effects.active().items():
        for field, path in effect.adds_to:
            own, more = attrgetter(path)(scenario.drive), getattr(effect, field)
            if own > 0 and more > 0:
                found.append(
                    f"effects.{name}.{field}: found {more:.4g} on top of the {own:.4g} of drive.{path}, "
                    "which counts too; set that to 0 where the effect is all there is"
                )
    return found
