"""What an engineer asks of a run: its numbers beside what the catalogue allows, and what to doubt."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hdsim.drive.presets import catalogue_figures, preset_names
from hdsim.drive.ratings import ratings_of_preset
from hdsim.studies.metrics._spans import ARCSEC
from hdsim.studies.metrics.teeth import mean_tooth_force_n
from hdsim.studies.run_metrics import Measured, RunMetrics

if TYPE_CHECKING:
    from hdsim.recording import Event
    from hdsim.scenario import Scenario

#: The numbers of a run in the order in which they are told: sections of metrics' names.
SECTIONS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "accuracy",
        (
            "positioning_error", "positioning_error_peak", "settling_time", "overshoot",
            "limit_cycle_amplitude", "limit_cycle_frequency", "tracking_error_rms", "tracking_error_max",
            "positioning_accuracy", "positioning_repeatability", "positioning_reversal",
            "transmission_accuracy", "transmission_reversal", "lost_motion", "backlash", "hysteresis_loss",
            "stiffness_k1",
        ),
    ),
    (
        "load",
        (
            "output_torque_max", "output_torque_rms", "average_load_torque", "motor_torque_max",
            "motor_torque_rms", "input_speed_max", "average_input_speed", "tooth_force_max", "bearing_life",
        ),
    ),
)  # fmt: skip

#: Events that only count those before them (``hdsim.simulation.quota``).
_COUNTED = re.compile(r"\d+ more times? until ")


@dataclass(frozen=True)
class Row:
    """A number of a run.

    Args:
        section: ``accuracy`` or ``load``.
        name: of the metric.
        measured: the number.
        limit: what it is held against, in its unit; None without.
        of: what the limit is.
        least: whether the limit is a lower one.
    """

    section: str
    name: str
    measured: Measured
    limit: float | None = None
    of: str = ""
    least: bool = False

    @property
    def holds(self) -> bool | None:
        """Whether the number is within its limit; a time that never comes and a swing at rest are in none.

        None without a limit.
        """
        if self.name == "limit_cycle_amplitude" or (math.isinf(self.measured.value) and not self.least):
            return False
        if self.limit is None:
            return None
        return self.measured.value >= self.limit if self.least else self.measured.value <= self.limit


def engineering_rows(numbers: RunMetrics) -> list[Row]:
    """The numbers that the run shows, each with what it may be.

    What is within one of several limits is held against the tightest that it keeps, else against the last.
    """
    found = []
    allowed = _limits(numbers.scenario)
    for section, names in SECTIONS:
        for name in names:
            measured = numbers.get(name)
            if measured is None or (name.startswith("limit_cycle") and measured.value == 0.0):
                continue
            limits = allowed.get(name, [])
            kept = [one for one in limits if measured.value <= one[0]]
            chosen: Sequence[tuple[float | None, str]] = kept[:1] or limits[-1:]
            limit, of = chosen[0] if chosen else (None, _beside(name, numbers))
            found.append(Row(section, name, measured, limit, of, name == "bearing_life"))
    return found


def _limits(scenario: Scenario) -> dict[str, list[tuple[float, str]]]:
    """What the numbers may be, tightest first, with what says so."""
    preset, rated = scenario.drive.preset, scenario.drive.rated_torque_nm
    gear = ratings_of_preset(preset)

    def rating(*fields: str) -> list[tuple[float, str]]:
        figures = [(getattr(gear, field, None), field.replace("_", " ")) for field in fields]
        return [(figure.value, name) for figure, name in figures if figure is not None]

    motor = getattr(scenario.command.motor, "torque_limit_nm", None)
    found = {
        "positioning_error": [(scenario.evaluation.settling_band_arcsec, "settling band")],
        "output_torque_max": rating("repeated_peak_torque", "momentary_peak_torque")
        or [(rated, "rated torque")],
        "output_torque_rms": [(rated, "rated torque")],
        "average_load_torque": rating("average_torque"),
        "motor_torque_max": [] if motor is None else [(motor, "motor's limit")],
        "input_speed_max": rating("maximum_input_speed"),
        "average_input_speed": rating("average_input_speed"),
        "bearing_life": rating("rated_life"),
    }
    if preset in preset_names():
        printed = catalogue_figures(str(preset))
        for name, figure in (
            ("transmission_accuracy", printed.accuracy),
            ("lost_motion", printed.lost_motion),
            ("hysteresis_loss", printed.hysteresis_loss),
        ):
            found[name] = [(ARCSEC * figure.value, "catalogue")]
    return found


def _beside(name: str, numbers: RunMetrics) -> str:
    """What there is to say of a number that has no limit."""
    scenario = numbers.scenario
    if name == "settling_time":
        return f"to ±{scenario.evaluation.settling_band_arcsec:g} arcsec of the target"
    if name == "tooth_force_max":
        return f"mean at rated torque {mean_tooth_force_n(scenario, scenario.drive.rated_torque_nm):.3g} N"
    if name in ("positioning_error_peak", "limit_cycle_amplitude"):
        return "while the command rests"
    return ""


def told_events(events: Sequence[Event], most: int = 8) -> list[Event]:
    """The warnings and errors of a run, the first of each kind, errors first.

    Args:
        events: of the run.
        most: number that is told.
    """
    first: dict[str, Event] = {}
    for event in events:
        if event.level in ("warning", "error") and not _COUNTED.match(event.message):
            kind = " ".join(word for word in event.message.split() if not any(c.isdigit() for c in word))
            first.setdefault(kind, event)
    ranked = sorted(first.values(), key=lambda event: (event.level != "error", event.time))
    return ranked[:most]
