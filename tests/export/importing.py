"""A scenario's joint in the engines that import it: MuJoCo, stepped by a loop of its own, and FMPy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

import hdsim
from hdsim.actuation.command import (
    PositionCommand,
    TorqueCommand,
    VelocityCommand,
)
from hdsim.actuation.sampled import SampledController
from hdsim.export.mujoco import TIMESTEP_S, Rest, mjcf
from hdsim.scenario import Scenario

Array = NDArray[np.float64]
Signal = Callable[[Array], Array]

#: Inertia of a side that is moved: its torque does not bend the motion, kg m^2.
_DRIVEN = 1e9


SCENARIOS = Path(__file__).parents[2] / "scenarios"
#: What is shipped and has a torque: ``warm_up`` and the bases of other rigs turn or stand without load, and
#: ``constant_speed`` rattles in its play (docs/export.md).
SHIPPED = [
    path
    for path in sorted([*SCENARIOS.glob("*.yaml"), *SCENARIOS.glob("arms/*.yaml")])
    if path.stem not in ("warm_up", "constant_speed")
]


def loaded(path: Path) -> Scenario:
    """A shipped scenario, its first 0.3 s."""
    return shortened(hdsim.load_scenario(path), 0.3)


def shortened(one: Scenario, most_s: float) -> Scenario:
    """The scenario's first seconds, at 1 kHz."""
    run = {"duration_s": min(one.run.duration_s, most_s), "sample_rate_hz": 1000, "teeth_rate_hz": 0}
    return one.with_({f"run.{name}": value for name, value in run.items()})


class MujocoJoint:
    """The exported file in MuJoCo, commanded as the scenario says.

    A controller runs at every step of MuJoCo, or at its own sample period; what is moved follows its motion.
    """

    def __init__(self, one: Scenario, *, callback: bool) -> None:
        self.one = one
        self.model = mujoco.MjModel.from_xml_string(mjcf(one)[0])
        self.data = mujoco.MjData(self.model)
        self.rest = Rest(one, self.model) if callback else None
        start, ratio = one.run.start, one.drive.ratio
        self.data.qpos[:2] = start.motor_angle_rad, start.motor_angle_rad / ratio + start.output_twist_rad
        self.data.qvel[0] = start.motor_velocity_rad_per_s
        self.data.qvel[1] = start.motor_velocity_rad_per_s / ratio
        self.moved = {m.axis: m.signal for m in one.command.motions(ratio)}
        for side in self.moved:
            self.model.dof_armature[("motor", "output").index(side)] = _DRIVEN
        command = one.command.motor
        self.controller: SampledController | None = None
        self.every = 1
        if isinstance(command, PositionCommand | VelocityCommand):
            period = command.sample_period_s or TIMESTEP_S
            self.every = round(period / TIMESTEP_S)
            assert self.every * TIMESTEP_S == period
            self.controller = command.model_copy(update={"sample_period_s": period}).sampled(ratio)

    def torque(self, sample_s: float = 1e-3) -> Array:
        """Torque of the drive on the output at every sample of the run, N m."""
        every, count = round(sample_s / TIMESTEP_S), round(self.one.run.duration_s / TIMESTEP_S)
        found = []
        mujoco.set_mjcb_passive(self.rest)
        try:
            for k in range(count + 1):
                self._command(k)
                if k % every == 0:
                    mujoco.mj_forward(self.model, self.data)
                    found.append(self._now())
                mujoco.mj_step(self.model, self.data)
        finally:
            mujoco.set_mjcb_passive(None)
        return np.array(found)

    def _now(self) -> float:
        return float(self.data.qfrc_passive[1]) if self.rest is None else self.rest.output_torque_nm

    def _command(self, k: int) -> None:
        """Set controls and motions of step k."""
        time = k * TIMESTEP_S
        one, data = self.one, self.data
        for side, signal in self.moved.items():
            at = ("motor", "output").index(side)
            angle, velocity = signal.values([time], [time + 1e-9])[:2, 0]
            data.qpos[at], data.qvel[at] = angle, velocity
        middle = [time + TIMESTEP_S / 2]
        command = one.command.motor
        if isinstance(command, TorqueCommand):
            data.ctrl[0] = command.torque.data.values(middle)[0, 0]
        elif self.controller is not None and k % self.every == 0:
            names = ("motor_angle", "motor_velocity", "output_angle", "output_velocity")
            numbers = (data.qpos[0], data.qvel[0], data.qpos[1], data.qvel[1])
            data.ctrl[0] = self.controller.update(time, dict(zip(names, numbers, strict=True)))
        if one.load.torque is not None:
            data.ctrl[1] = one.load.torque.data.values(middle)[0, 0]


def deviation(found: Array, wanted: Array) -> float:
    """Deviation (rms) over the rms of what is wanted."""
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))
