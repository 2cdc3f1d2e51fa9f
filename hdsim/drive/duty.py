"""A duty cycle against what a gear may carry, by the makers' selection procedure.

Harmonic Drive AG, engineering data 1019659 11/2014, p. 18, Eq. 18.2 to 18.11 (for the life also CSF/CSG
catalogue of Harmonic Drive LLC, p. 14): cubic mean of the torque weighed by the speed, average and largest
input speed, largest torque in operation, torque and number of emergency stops, life of the wave-generator
bearing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive.ratings import bearing_life_h

if TYPE_CHECKING:
    from hdsim.drive.printed import Figure
    from hdsim.drive.ratings import Ratings

#: Passes of a lobe over a place of the flexspline that it stands under a momentary peak torque (Eq. 18.10).
MOMENTARY_CYCLES = 1e4

#: Where each limit is defined.
PROCEDURE = "Harmonic Drive AG, engineering data 1019659 11/2014, p. 18"


def average_torque(
    torque_nm: NDArray[np.float64], speed: NDArray[np.float64], time_s: NDArray[np.float64]
) -> float:
    """Cubic mean of the torque, N m: (sum |n| |T|^3 t / sum |n| t)^(1/3), Eq. 18.2.

    Args:
        torque_nm: of every span, shape (n,), N m.
        speed: of every span, shape (n,), in any unit.
        time_s: length of every span, shape (n,), s.

    Returns:
        Zero where nothing turns.
    """
    travel = np.abs(speed) * time_s
    total = float(np.sum(travel))
    return float(np.sum(travel * np.abs(torque_nm) ** 3) / total) ** (1.0 / 3.0) if total > 0.0 else 0.0


def bearing_averages(
    time_s: NDArray[np.float64], torque_nm: NDArray[np.float64], speed: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Duration, travel and travel weighed by the cubed torque of a sampled motion, by the trapezoidal rule.

    Args:
        time_s: shape (n,), s.
        torque_nm: at the output, shape (n,), N m.
        speed: of the wave generator, shape (n,), rad/s.

    Returns:
        s, rad and rad (N m)^3; T_av is the cube root of the third over the second.
    """
    travel = np.abs(speed)
    return (
        float(time_s[-1] - time_s[0]),
        float(np.trapezoid(travel, time_s)),
        float(np.trapezoid(travel * np.abs(torque_nm) ** 3, time_s)),
    )


def averages(duration_s: float, travel_rad: float, cubed: float) -> tuple[float, float]:
    """Cubic mean of the torque in N m and mean input speed in rpm, of what ``bearing_averages`` sums up.

    Both 0 where nothing turns.
    """
    if travel_rad == 0.0:
        return 0.0, 0.0
    return (cubed / travel_rad) ** (1.0 / 3.0), travel_rad / duration_s * 30.0 / math.pi


@dataclass(frozen=True)
class Stop:
    """An emergency stop or a collision.

    Args:
        torque_nm: at the output, N m.
        speed_rpm: of the output, rpm.
        duration_s: how long it lasts, s.
    """

    torque_nm: float
    speed_rpm: float
    duration_s: float


@dataclass(frozen=True)
class Duty:
    """What a load cycle asks of a gear, at the output.

    Args:
        average_torque_nm: cubic mean, N m.
        average_speed_rpm: over the whole cycle, pauses included, rpm.
        largest_torque_nm: in normal operation, N m.
        largest_speed_rpm: at any moment, rpm.
        stop: what may happen besides, or None.
        stops: how often; 0 where that is not known.
        life_h: wanted life, h; 0 for any.
    """

    average_torque_nm: float
    average_speed_rpm: float
    largest_torque_nm: float
    largest_speed_rpm: float
    stop: Stop | None = None
    stops: int = 0
    life_h: float = 0.0


@dataclass(frozen=True)
class Check:
    """One limit of a gear and what is asked of it.

    Args:
        name: what is compared.
        unit: of both.
        asked: by the cycle.
        allowed: by the gear; None where no source gives it.
        least: whether ``asked`` must be at least reached (a life) instead of at most.
        source: of the allowed value; empty where there is none.
    """

    name: str
    unit: str
    asked: float
    allowed: float | None
    least: bool = False
    source: str = ""

    @property
    def margin(self) -> float | None:
        """Allowed over asked (a life: reached over wanted), 1 is just enough; None if nothing is printed."""
        if self.allowed is None:
            return None
        return math.inf if self.asked == 0.0 else self.allowed / self.asked

    @property
    def holds(self) -> bool | None:
        """Whether the gear stands it; None where nothing is printed."""
        margin = self.margin
        return None if margin is None else margin >= 1.0


def momentary_stops(ratio: float, stop: Stop) -> float:
    """How many such stops a gear stands: 10^4 / (2 n_k i t_k / 60), Eq. 18.10; infinite at rest."""
    turns = abs(stop.speed_rpm) * abs(ratio) * stop.duration_s / 60.0
    return MOMENTARY_CYCLES / (2.0 * turns) if turns > 0.0 else math.inf


def checks(gear: Ratings, duty: Duty) -> list[Check]:
    """Every limit of a gear against a duty, in the order of the makers' procedure."""
    found: list[Check] = []

    def add(name: str, unit: str, asked: float, figure: Figure | None) -> None:
        allowed = figure.value if figure else None
        found.append(Check(name, unit, asked, allowed, source=figure.source.citation if figure else ""))

    average_input = gear.ratio * duty.average_speed_rpm
    add("average torque", "N m", duty.average_torque_nm, gear.average_torque)
    add("average input speed", "rpm", average_input, gear.average_input_speed)
    add("largest input speed", "rpm", gear.ratio * duty.largest_speed_rpm, gear.maximum_input_speed)
    add("repeated peak torque", "N m", duty.largest_torque_nm, gear.repeated_peak_torque)
    worst = duty.largest_torque_nm
    if duty.stop is not None:
        worst = max(worst, abs(duty.stop.torque_nm))
        add("momentary peak torque", "N m", abs(duty.stop.torque_nm), gear.momentary_peak_torque)
        if duty.stops:
            allowed = momentary_stops(gear.ratio, duty.stop)
            found.append(Check("momentary peaks", "1", float(duty.stops), allowed, source=PROCEDURE))
    add("ratcheting torque", "N m", worst, gear.ratcheting_torque)
    add("buckling torque", "N m", worst, gear.buckling_torque)
    if gear.rated_torque is not None:
        life = bearing_life_h(gear, duty.average_torque_nm, average_input)
        source = gear.rated_life.source.citation
        found.append(Check("bearing life L10", "h", duty.life_h, life, True, source))
    return found
