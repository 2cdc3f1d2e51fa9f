"""The six-joint arm as a forward simulation: MuJoCo integrates all joints, one of them through a drive.

Each joint follows its motion by a controller (inverse dynamics of the motion, and a stiff spring and damper).
The drive in one joint is rigid: q = theta / N + e(theta) ties output and motor, so by virtual work the output
has

    tau = (T - T_f - T_r) / s - J (q'' - e'' theta'^2) / s^2,   s = 1 / N + e',

with motor torque T, friction T_f, ripple T_r and rotor J. The term of q'' is MuJoCo's armature, J / s^2,
which changes with the angle; the rest is a force. The controller does not know friction, ripple or error.
"""

from __future__ import annotations

from dataclasses import dataclass

import arm_plant as plant
import mujoco
import numpy as np

STEP_S, SPRING_RAD_PER_S = 2.5e-4, 60.0


@dataclass(frozen=True)
class Hidden:
    """What is in the drive: Coulomb friction, ripple of the motor's torque, kinematic error."""

    coulomb_nm: float = plant.COULOMB
    ripple_nm: float = 0.0
    ripple_order: float = 1.0
    error_rad: float = 0.0
    error_order: float = 2.0
    phase: float = 0.0

    def error(self, angle: float) -> tuple[float, float, float]:
        """Error e, its slope and its bend over the motor's angle."""
        n, at = self.error_order, self.error_order * angle + self.phase
        e = self.error_rad * np.sin(at)
        return e, self.error_rad * n * np.cos(at), -n * n * e

    def torque(self, angle: float, speed: float) -> float:
        """What the motor's torque has to carry beside rotor and load."""
        ripple = self.ripple_nm * np.sin(self.ripple_order * angle + self.phase)
        return float(self.coulomb_nm * np.tanh(speed / 0.5) + plant.VISCOUS * speed + ripple)


def run(joint: int, hidden: Hidden, seconds: float, seed: int) -> dict[str, np.ndarray]:
    """Time (n,), angles of all joints (n, 6), motor angle and motor torque (n,) at the plant's rate."""
    arm = plant.arm()
    arm.opt.timestep, arm.opt.integrator = STEP_S, mujoco.mjtIntegrator.mjINT_EULER
    data = mujoco.MjData(arm)
    every = round(1.0 / plant.RATE / STEP_S)
    fine = np.arange(round(seconds / STEP_S)) * STEP_S
    motion = plant.at(fine, seed)
    forward = plant.carried(motion)
    data.qpos[:], data.qvel[:] = motion[0, 0], motion[1, 0]
    angle = plant.RATIO * data.qpos[joint]
    found = {name: [] for name in ("time", "joints", "motor_angle", "motor_torque")}
    helped = np.zeros(arm.nv)
    for k, now in enumerate(fine):
        for _ in range(3):  # the motor's angle that belongs to the output's, by Newton
            e, slope, bend = hidden.error(angle)
            angle -= (angle / plant.RATIO + e - data.qpos[joint]) / (1 / plant.RATIO + slope)
        e, slope, bend = hidden.error(angle)
        s = 1 / plant.RATIO + slope
        speed = data.qvel[joint] / s
        arm.dof_armature[joint] = plant.ROTOR / s**2
        mujoco.mj_forward(arm, data)
        behind = motion[0, k] - data.qpos, motion[1, k] - data.qvel
        pull = SPRING_RAD_PER_S**2 * behind[0] + 2 * SPRING_RAD_PER_S * behind[1]
        mujoco.mj_mulM(arm, data, helped, pull)
        asked = forward[k] + helped
        torque = asked[joint] * s + plant.ROTOR * motion[2, k, joint] / s
        data.qfrc_applied[:] = asked
        data.qfrc_applied[joint] = (
            torque - hidden.torque(angle, speed)
        ) / s + plant.ROTOR * bend * speed**2 / s**2
        if k % every == 0:
            for name, value in (("time", now), ("joints", data.qpos.copy()), ("motor_angle", angle),
                                ("motor_torque", torque)):  # fmt: skip
                found[name].append(value)
        mujoco.mj_step(arm, data)
    return {name: np.array(values) for name, values in found.items()}
