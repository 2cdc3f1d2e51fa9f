"""What the catalogue allows the drive of a run: torques, speeds, life of the wave-generator bearing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdsim.drive.duty import averages, bearing_averages
from hdsim.drive.ratings import Ratings, bearing_life_h
from hdsim.recording import Event
from hdsim.simulation.watches import Watch

Array = NDArray[np.float64]

#: Torques that a drive survives once, or not: what is told of each, and what else there is to say.
_TORQUES = {
    "momentary_peak_torque": ("momentary peak torque", ""),
    "ratcheting_torque": ("ratcheting torque", ", at which teeth skip in a real drive and never here,"),
    "buckling_torque": ("buckling torque", ", at which the flexspline of a real drive folds and never here,"),
}


def torque_watches(gear: Ratings, margin: float) -> list[Watch]:
    """One for every torque that is on record for the gear, over the absolute output torque in N m.

    Args:
        gear: its ratings.
        margin: share of the limit below which it counts as kept again.
    """
    found = []
    for field, (name, besides) in _TORQUES.items():
        figure = getattr(gear, field)
        if figure is not None:
            limit = float(figure.value)
            text = f"{name}{besides} of {limit:.4g} N m exceeded"
            again = f"torque below the {name} again"
            found.append(Watch("drive", "error", text, again, limit, limit * margin))
    return found


def speed_watches(gear: Ratings, margin: float) -> list[Watch]:
    """One for the largest input speed, over the absolute motor speed in rad/s."""
    if gear.maximum_input_speed is None:
        return []
    rpm = gear.maximum_input_speed.value
    limit = rpm * math.pi / 30.0
    text = f"maximum input speed of {rpm:.4g} rpm exceeded"
    return [
        Watch(
            "drive",
            "warning",
            text,
            "input speed below its maximum again",
            limit * (1 + 1e-9),
            limit * margin,
        )
    ]


@dataclass
class Bearing:
    """The wave-generator bearing: what a run asks of it.

    Args:
        gear: its ratings, the rated torque among them.
    """

    gear: Ratings
    _last: tuple[float, float, float] | None = None
    _duration: float = 0.0
    _travel: float = 0.0
    _cubed: float = 0.0

    def feed(self, time: Array, torque: Array, speed: Array) -> None:
        """The next samples: time (n,) in s, output torque (n,) in N m, motor speed (n,) in rad/s."""
        if self._last is not None:
            time, torque, speed = (
                np.concatenate([[before], now])
                for before, now in zip(self._last, (time, torque, speed), strict=True)
            )
        self._last = (float(time[-1]), float(torque[-1]), float(speed[-1]))
        duration, travel, cubed = bearing_averages(time, torque, speed)
        self._duration += duration
        self._travel += travel
        self._cubed += cubed

    @property
    def life_h(self) -> float:
        """Life L10 if the run went on for ever, h; infinite where nothing turns under load."""
        return bearing_life_h(self.gear, *averages(self._duration, self._travel, self._cubed))

    def told(self, time: float) -> Iterator[Event]:
        """The event of a life below the rated one."""
        life, rated = self.life_h, self.gear.rated_life.value
        if life < rated:
            text = (
                f"bearing life L10 {life:.3g} h if this run went on for ever, below the rated {rated:.0f} h"
            )
            yield Event(time, "warning", "drive", text)
