"""Which gear carries a load cycle: the cycle as a file, and every gear on record judged by it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from hdsim.drive.duty import Check, Duty, Stop, average_torque, checks
from hdsim.drive.ratings import Ratings, rated_gears
from hdsim.parts import Parameters
from hdsim.scenario.validation import load_model


class Phase(Parameters):
    """A span of the cycle with one torque and one speed."""

    torque_nm: float
    """Torque of the load at the output, with its sign or without."""
    speed_rpm: float
    """Speed of the output; 0 in a pause."""
    duration_s: float = Field(gt=0)
    """How long it lasts."""


class EmergencyStop(Parameters):
    """An emergency stop or a collision."""

    torque_nm: float
    """Torque at the output."""
    speed_rpm: float = 0.0
    """Speed of the output when it happens."""
    duration_s: float = Field(gt=0)
    """How long it lasts."""
    times: int = Field(default=0, ge=0)
    """How often it may happen in the gear's life; 0 where that is not known."""


class LoadCycle(Parameters):
    """What a gear has to carry, over and over, at its output."""

    name: str = ""
    """What it is; the file's name when left out."""
    description: str = ""
    """Where it comes from."""
    phases: tuple[Phase, ...] = Field(min_length=1)
    """The spans of one cycle in their order, pauses included."""
    largest_speed_rpm: float | None = Field(default=None, ge=0)
    """Largest speed of the output at any moment; that of the phases when left out."""
    emergency_stop: EmergencyStop | None = None
    """What may happen besides."""
    life_h: float = Field(default=0.0, ge=0)
    """Wanted life L10 of the wave-generator bearing; 0 for any."""
    series: tuple[Literal["csg", "shg"], ...] = Field(default=("csg",), min_length=1)
    """Series to choose from."""
    ratios: tuple[Literal[50, 80, 100, 120, 160], ...] = Field(default=(50, 80, 100, 120, 160), min_length=1)
    """Ratios to choose from."""

    def duty(self) -> Duty:
        """What the cycle asks of a gear (``hdsim.drive.duty``)."""
        torque = np.array([phase.torque_nm for phase in self.phases])
        speed = np.array([phase.speed_rpm for phase in self.phases])
        time = np.array([phase.duration_s for phase in self.phases])
        stop = self.emergency_stop
        fastest = float(np.max(np.abs(speed)))
        return Duty(
            average_torque_nm=average_torque(torque, speed, time),
            average_speed_rpm=float(np.sum(np.abs(speed) * time) / np.sum(time)),
            largest_torque_nm=float(np.max(np.abs(torque))),
            largest_speed_rpm=max(fastest, self.largest_speed_rpm or 0.0),
            stop=None if stop is None else Stop(stop.torque_nm, stop.speed_rpm, stop.duration_s),
            stops=0 if stop is None else stop.times,
            life_h=self.life_h,
        )


@dataclass(frozen=True)
class Choice:
    """A gear and what the cycle does to it.

    Args:
        gear: what it may carry.
        checks: every limit with what is asked of it.
    """

    gear: Ratings
    checks: tuple[Check, ...]

    @property
    def carries(self) -> bool:
        """Whether no limit that is printed is exceeded."""
        return all(check.holds is not False for check in self.checks)

    @property
    def refusals(self) -> list[str]:
        """Why not: one phrase for every limit that is exceeded."""
        return [
            f"{check.name} {check.asked:.4g} {check.unit}, allowed {check.allowed:.4g}"
            if not check.least
            else f"{check.name} {check.allowed:.4g} {check.unit}, wanted {check.asked:.4g}"
            for check in self.checks
            if check.holds is False
        ]


def load_cycle(path: str | Path) -> LoadCycle:
    """Read a load cycle.

    Raises:
        ScenarioError: one line for every mistake, with file and line.
    """
    cycle = load_model(path, LoadCycle)
    return cycle if cycle.name else cycle.model_copy(update={"name": Path(path).stem[:200]})


def select(cycle: LoadCycle) -> list[Choice]:
    """Every gear of the cycle's series and ratios, small sizes first."""
    duty = cycle.duty()
    return [
        Choice(gear, tuple(checks(gear, duty)))
        for series in cycle.series
        for gear in rated_gears(series)
        if gear.ratio in cycle.ratios
    ]
