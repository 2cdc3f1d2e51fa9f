"""The torsion cycle with the motor locked: stiffness, hysteresis loss, lost motion, backlash."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.recording import Recording
from hdsim.studies.metrics._spans import ARCSEC
from hdsim.studies.registry import metric

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

_CHA = "Harmonic Drive AG, CHA manual 1018854, torsional stiffness: K1, K2, K3 between 0, T1, T2 and T_N"
_LOSS = "angle between the branches of the torsion cycle at zero torque (Nabtesco, Harmonic Drive AG)"
_LOST = "angle between the points of the loop's centre line at plus and minus a share of rated torque"

#: Shares of rated torque between which the lines that are extended to zero torque are fitted.
_BACKLASH_FIT = (0.01, 0.03)
#: Share of the cycle's torque that may accelerate the load: the bench's own cycle stays below 0.1 %.
_INERTIAL = 0.02


@dataclass(frozen=True)
class TorsionLoop:
    """A closed loop of angle over torque: down from the largest torque to the smallest and up again.

    Args:
        torque: common torques, increasing, N m, shape (n,).
        rising: output angle while the torque rises, rad, shape (n,).
        falling: output angle while it falls, rad, shape (n,).
    """

    torque: Array
    rising: Array
    falling: Array

    @property
    def peak(self) -> float:
        """Largest torque that both signs reach, N m."""
        return float(min(-self.torque[0], self.torque[-1]))

    @property
    def centre(self) -> Array:
        """Centre line: mean of the branches, rad."""
        return 0.5 * (self.rising + self.falling)

    @property
    def hysteresis_loss(self) -> float:
        """Angle between the branches at zero torque, rad."""
        return float(np.interp(0.0, self.torque, self.falling) - np.interp(0.0, self.torque, self.rising))

    def lost_motion(self, torque_nm: float) -> float:
        """Angle between the centre line's points at plus and minus a torque, rad.

        Raises:
            InputError: the loop does not reach it.
        """
        self._reaches(torque_nm)
        low, high = np.interp([-torque_nm, torque_nm], self.torque, self.centre)
        return float(high - low)

    def backlash(self, from_nm: float, to_nm: float) -> float:
        """Play: gap between the elastic lines of both signs, extended to zero torque, rad.

        A straight line is fitted to each branch between the two torques, for each sign; the play is how far
        apart the two lines of a branch pass zero torque, mean of both branches (dead-zone model of Nordin
        and Gutman 2002, Automatica 38:1633). Free play is found whole; a spring that merely softens towards
        zero torque shows as far as it softens below ``from_nm``.

        Raises:
            InputError: the loop does not reach the torques.
        """
        self._reaches(to_nm)
        at = np.linspace(from_nm, to_nm, 50)
        gaps = []
        for branch in (self.rising, self.falling):
            high = np.polynomial.Polynomial.fit(at, np.interp(at, self.torque, branch), 1)
            low = np.polynomial.Polynomial.fit(-at, np.interp(-at, self.torque, branch), 1)
            gaps.append(high(0.0) - low(0.0))
        return float(np.mean(gaps))

    def stiffness(self, corners_nm: tuple[float, ...]) -> tuple[float, ...]:
        """Secants of the centre line between 0 and the torques, mean of both signs, N m/rad.

        Raises:
            InputError: the loop does not reach the last torque.
        """
        self._reaches(corners_nm[-1])
        corners = np.array([0.0, *corners_nm])
        high, low = (np.interp(sign * corners, self.torque, self.centre) for sign in (1.0, -1.0))
        return tuple(float(k) for k in np.diff(corners) / np.diff(0.5 * (high - low)))

    def _reaches(self, torque_nm: float) -> None:
        if torque_nm > self.peak * (1.0 + 1e-9):
            raise InputError(
                f"the torsion cycle ends at {self.peak:.4g} N m; this needs {torque_nm:.4g} N m in both signs"
            )


def torsion_loop(recording: Recording) -> TorsionLoop:
    """The last closed loop of a torsion cycle (0, +T, 0, -T, 0, +T) with the motor locked.

    The torque is the one that the bench applies, ``load_torque``; the angle is the output's.

    Raises:
        InputError: the motor moves, or the torque does not go from one extreme to the other and back.
    """
    torque, angle = recording["load_torque"], recording["output_angle"]
    if np.ptp(recording["motor_angle"]) > 1e-6:
        raise InputError("a torsion cycle needs a locked motor (command.motor.type: locked); it turns here")
    span = float(np.ptp(torque))
    top = np.flatnonzero(torque >= np.max(torque) - 1e-3 * span)
    bottom = np.flatnonzero(torque <= np.min(torque) + 1e-3 * span)
    both = torque.min() < 0.0 < torque.max()
    if not both or bottom[0] > top[-1] or top[0] > bottom[-1]:
        raise InputError(
            "a torsion cycle needs the load torque to go 0, +T, 0, -T, 0, +T; here it does not come back"
        )
    end = int(top[-1])
    middle = int(bottom[bottom < end][-1])
    start = int(top[top < middle][-1])
    down, up = slice(start, middle + 1), slice(middle, end + 1)
    low, high = torque[middle], min(torque[start], torque[end])
    grid = np.unique(np.concatenate([np.linspace(low, high, 4001), [0.0]]))
    rising = np.interp(grid, *_monotone(torque[up], angle[up]))
    falling = np.interp(grid, *_monotone(torque[down][::-1], angle[down][::-1]))
    return TorsionLoop(grid, rising, falling)


def _monotone(torque: Array, angle: Array) -> tuple[Array, Array]:
    """The samples at which the torque is larger than ever before."""
    kept = np.concatenate([[True], torque[1:] > np.maximum.accumulate(torque)[:-1]])
    return torque[kept], angle[kept]


def slow_loop(recording: Recording, scenario: Scenario) -> TorsionLoop:
    """The loop of a load torque that winds the drive and does not accelerate what hangs on it.

    Raises:
        InputError: as ``torsion_loop``; or more than ``_INERTIAL`` of the torque goes to the load's inertia.
    """
    loop = torsion_loop(recording)
    accelerated = scenario.load.over(0.0)[1] * np.gradient(recording["output_velocity"], recording.time)
    # Seldom ones are those of a passage through play.
    usual = float(np.quantile(np.abs(accelerated), 0.99))
    if usual > _INERTIAL * loop.peak:
        raise InputError(
            "a torsion cycle needs a load torque that changes slowly; here "
            f"{usual:.3g} of {loop.peak:.3g} N m accelerate the load"
        )
    return loop


def _corners(loop: TorsionLoop, scenario: Scenario) -> tuple[float, ...]:
    torsion = scenario.drive.torsion
    return (torsion.torque_t1_nm, torsion.torque_t2_nm, loop.peak)


def _stiffness_metric(k: int, of: str) -> None:
    @metric(f"stiffness_k{k}", "N m/rad", f"torsional stiffness, secant {of}, motor locked", _CHA)
    def stiffness(recording: Recording, scenario: Scenario) -> float:
        loop = slow_loop(recording, scenario)
        corners = _corners(loop, scenario)[:k]
        if k == 3 and corners[2] < 1.02 * corners[1]:
            raise InputError(
                f"K3 needs a torsion cycle beyond T2 = {corners[1]:g} N m; it ends at {loop.peak:g} N m"
            )
        return loop.stiffness(corners)[k - 1]


for _k, _of in ((1, "from 0 to T1"), (2, "from T1 to T2"), (3, "from T2 to the end of the cycle")):
    _stiffness_metric(_k, _of)


@metric("hysteresis_loss", "arcsec", "width of the torsion cycle at zero torque, play included", _LOSS)
def hysteresis_loss(recording: Recording, scenario: Scenario) -> float:
    """Angle between the branches at zero torque, arcsec."""
    return ARCSEC * slow_loop(recording, scenario).hysteresis_loss


def lost_motion_at(recording: Recording, scenario: Scenario, share: float) -> float:
    """Lost motion at plus and minus a share of the rated torque, arcsec."""
    return ARCSEC * slow_loop(recording, scenario).lost_motion(share * scenario.drive.rated_torque_nm)


@metric("lost_motion", "arcsec", "lost motion at +-3 % of rated torque", f"{_LOST}: 3 % (Nabtesco, Spinea)")
def lost_motion(recording: Recording, scenario: Scenario) -> float:
    """Lost motion at 3 % of rated torque, arcsec."""
    return lost_motion_at(recording, scenario, 0.03)


@metric(
    "lost_motion_4_percent",
    "arcsec",
    "lost motion at +-4 % of rated torque",
    f"{_LOST}: 4 % (Harmonic Drive; Materials 2021, 14:5057)",
)
def lost_motion_4_percent(recording: Recording, scenario: Scenario) -> float:
    """Lost motion at 4 % of rated torque, arcsec."""
    return lost_motion_at(recording, scenario, 0.04)


@metric(
    "backlash",
    "arcsec",
    "free play: gap between the elastic lines of both signs at zero torque",
    "dead-zone model, Nordin and Gutman 2002, Automatica 38:1633; lines fitted at 1 to 3 % of rated torque",
)
def backlash(recording: Recording, scenario: Scenario) -> float:
    """Play, arcsec."""
    rated = scenario.drive.rated_torque_nm
    return ARCSEC * slow_loop(recording, scenario).backlash(*(share * rated for share in _BACKLASH_FIT))


@metric(
    "torsional_heat_per_cycle",
    "J",
    "area of the torsion cycle: work that one cycle turns into heat",
    "integral of torque over angle round the loop",
)
def torsional_heat_per_cycle(recording: Recording, scenario: Scenario) -> float:
    """Area of the loop, J."""
    loop = slow_loop(recording, scenario)
    return float(np.trapezoid(loop.falling - loop.rising, loop.torque))
