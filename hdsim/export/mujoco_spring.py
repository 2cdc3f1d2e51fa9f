"""A drive's spring as MuJoCo says it: a sum of springs with dead bands, straight from corner to corner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hdsim.drive.contributed import Contributed

if TYPE_CHECKING:
    from hdsim.parts import Effect
    from hdsim.scenario import Scenario

#: Torque up to which the corners are placed, as a multiple of rated torque; straight beyond.
_REACH = 2.0
#: Largest deviation in torque between corners, as a share of rated torque, and the most corners.
_TOLERANCE = 2e-3
_CORNERS = 12
#: Twists among which corners are chosen.
_POINTS = 401


class Probe(Contributed):
    """Finds out what an effect adds to a model."""

    def __init__(self, scenario: Scenario, effect: Effect) -> None:
        super().__init__()
        self.ratio, self.rated_torque_nm = scenario.drive.ratio, scenario.drive.rated_torque_nm
        self.seed = scenario.run.seed
        effect.contribute(self)
        self.frictions = self._given.input_frictions
        given = self._given
        self.only_spring = not (given.elements or given.twists or given.sensors or given.gap_waves)
        self.film_share = given.film_share
        self.only_friction = len(self._given.elements) == len(self.frictions) == 1 and not self._given.twists


@dataclass(frozen=True)
class Spring:
    """torque = sum of k max(0, |s| - b) sign s over the bands, s the twist at the output.

    Args:
        bands: half width b of a dead band, rad, and stiffness k that acts beyond it, N m/rad; growing b.
        error: largest deviation from hdsim's torque up to twice rated torque, over rated torque.
        film_share: share of the damper that acts within the play, too.
    """

    bands: tuple[tuple[float, float], ...]
    error: float
    film_share: float

    @property
    def half_gap_rad(self) -> float:
        """Half of the play, at the output, rad."""
        return self.bands[0][0]


def straight_spring(scenario: Scenario) -> Spring:
    """Torque over twist as straight segments: motor held at 0, output turned, ring in its balance.

    Corners are added where the segments deviate most, until they no longer do (Ramer 1972, Computer Graphics
    and Image Processing 1:244). A catalogue's three segments come out as they are.
    """
    from hdsim.simulation.stepped import SteppedPlant

    rated = scenario.drive.rated_torque_nm
    effects = type(scenario.effects)(**_springs(scenario))
    bare = {"arm": None, "gravity": None, "torque": None, "inertia_kg_m2": 1.0}  # no load
    drive, load = scenario.drive, scenario.load.model_copy(update=bare)
    if getattr(drive.mesh, "ring", "static") != "static":
        drive = drive.model_copy(update={"mesh": drive.mesh.model_copy(update={"ring": "static"})})
    plain = scenario.model_copy(update={"effects": effects, "drive": drive, "load": load})
    plant = SteppedPlant(plain, motor="motion", output="motion")

    def one_way(twist: float) -> float:
        plant.hold({"prescribed_output_angle": -twist})
        return plant.values(["output_torque"])["output_torque"]

    def torque(twist: float) -> float:
        return 0.5 * (one_way(twist) - one_way(-twist))

    reach = drive.rated_torque_nm / drive.torsion.stiffness_k3_nm_per_rad
    while torque(reach) < _REACH * rated:
        reach *= 1.1
    low, high = 0.0, reach
    while high - low > 1e-7 * reach:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if torque(middle) <= 1e-9 * rated else (low, middle)
    gap = low if low > 1e-6 * reach else 0.0
    twists = np.linspace(gap, reach, _POINTS)
    torques = np.array([torque(twist) for twist in twists])
    torques[0] = 0.0
    corners = [0, _POINTS - 1]
    while True:
        off = np.abs(np.interp(twists, twists[corners], torques[corners]) - torques) / rated
        if off.max() < _TOLERANCE or len(corners) == _CORNERS:
            break
        corners = sorted([*corners, int(np.argmax(off))])
    slopes = np.diff(torques[corners]) / np.diff(twists[corners])
    changes = np.diff(slopes, prepend=0.0)
    bands = zip(twists[corners[:-1]].tolist(), changes.tolist(), strict=True)
    active = scenario.effects.active().values()
    film_share = max((Probe(scenario, effect).film_share for effect in active), default=0.0)
    return Spring(tuple(bands), float(off.max()), film_share)


def _springs(scenario: Scenario) -> dict[str, Effect]:
    """The effects that do nothing but change the spring."""
    active = scenario.effects.active().items()
    return {name: effect for name, effect in active if Probe(scenario, effect).only_spring}
