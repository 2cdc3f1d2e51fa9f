"""A scenario's joint as MJCF for MuJoCo (https://mujoco.readthedocs.io), and the rest as its callback.

Two hinges, ``motor`` and ``output``, coupled by fixed tendons of length motor angle / ratio - output angle,
the twist: their springs with dead bands add up to hdsim's own torque over twist, play included. What the
format cannot say is in a table, and ``Rest`` computes it while MuJoCo simulates.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from hdsim.actuation.command import FreeCommand, TorqueCommand
from hdsim.actuation.loads import STANDARD_GRAVITY
from hdsim.drive.parameters import Friction, RigidMesh
from hdsim.effects.load_dependent_loss import LoadDependentLoss
from hdsim.errors import InputError
from hdsim.export.mujoco_lost import Lost, Weighing
from hdsim.export.mujoco_spring import Probe, straight_spring

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: Step of the exported model, s; a drive's own resonances, motor locked, lie below 1 kHz.
TIMESTEP_S = 1e-4
_AXIS = "0 1 0"


def export_mujoco(scenario: Scenario, out: str | Path) -> tuple[Lost, ...]:
    """Write a scenario's joint as MJCF.

    Args:
        scenario: the joint.
        out: the file, ``.xml``.

    Returns:
        What the file does not hold, and what that does to the torque; it is in the file, too, as a comment.

    Raises:
        InputError: ``out`` cannot be written.
    """
    text, lost = mjcf(scenario, weigh=True)
    out = Path(out)
    partial = out.with_name(out.name + ".partial")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror})") from error
    return lost


def mjcf(scenario: Scenario, *, weigh: bool = False) -> tuple[str, tuple[Lost, ...]]:
    """A scenario's joint as MJCF, and what that leaves out.

    Args:
        scenario: the joint.
        weigh: whether to find what each thing that is left out does to the torque: a run of hdsim for each.

    Returns:
        The text, and what is lost. Friction that grows with the load is set by a run of the scenario's first
        seconds.
    """
    drive, load = scenario.drive, scenario.load
    lost: list[Lost] = []
    frictions = [(drive.friction.coulomb_nm, drive.friction.viscous_nm_s_per_rad)]
    weighing = Weighing(scenario)
    losses: list[LoadDependentLoss] = []
    for name, effect in scenario.effects.active().items():
        without: dict[str, Any] = {f"effects.{name}": None}
        probe = Probe(scenario, effect)
        if probe.only_friction:
            frictions += [(f.coulomb_nm, f.viscous_nm_s_per_rad) for f in probe.frictions]
        elif isinstance(effect, LoadDependentLoss):
            losses.append(effect)
        elif not probe.only_spring:
            lost.append(Lost(f"effect {name}: {effect.title}", "nothing", name != "sensors", without))
    if drive.friction.load_coefficient > 0 or losses:
        # MJCF has no friction that grows with a torque: that of the mean stands in for it.
        mean = weighing.mean_torque_nm
        lossy = drive.friction.load_coefficient * mean + sum(one.loss_nm(mean) for one in losses)
        frictions.append((lossy / abs(drive.ratio), 0.0))
        without = {"drive.friction.load_coefficient": 0.0}
        if losses:
            without["effects.load_dependent_loss"] = None
        told = f"friction of the mean torque, {mean:.3g} N m"
        lost.append(Lost("friction that grows with the load", told, without=without))
    coulomb, viscous = (sum(column) for column in zip(*frictions, strict=True))
    motor = drive.inertia.rotor_kg_m2
    with_output = drive.arrangement == "circular_spline_fixed"
    hanging = _Hanging(scenario)
    output = hanging.inertia_kg_m2 + (drive.inertia.ring_kg_m2 if with_output else 0.0)
    if isinstance(drive.mesh, RigidMesh):
        coupling = (
            '<equality><joint name="drive" joint1="output" joint2="motor" '
            f'polycoef="0 {1 / drive.ratio!r} 0 0 0" '
            f'solref="{3 * TIMESTEP_S!r} 1" solimp="0.9999 0.9999 0.001"/></equality>'
        )
    else:
        spring = straight_spring(scenario)
        error = f"straight segments, {100 * spring.error:.1f} % of rated torque off at most"
        lost.append(Lost("stiffness over the torque", error))
        if drive.mesh.model != "lumped":
            without = {"drive.mesh": {"model": "lumped"}}
            gone = "teeth: their own inertia, gaps and forces over the turn"
            lost.append(Lost(gone, "springs, with a dead band for the gap", without=without))
        coupling = "<tendon>" + "\n    ".join(
            _tendon(number, band, stiffness, drive.torsion.damping_nm_s_per_rad, drive.ratio)
            for number, (band, stiffness) in enumerate(spring.bands, 1)
        )
        coupling += "</tendon>"
        if spring.half_gap_rad and drive.torsion.damping_nm_s_per_rad and spring.film_share < 1.0:
            lost.append(Lost("damping in contact only", "damping within the play, too"))
    command = scenario.command.motor
    if not isinstance(command, TorqueCommand | FreeCommand):
        text = "the actuator motor: a torque, for the loop of your program"
        lost.append(Lost(f"command of the motor: {command.type}", text, by_callback=False))
    elif isinstance(command, TorqueCommand):
        lost.append(Lost("torque of the motor over time", "the actuator motor", by_callback=False))
    if load.torque is not None:
        lost.append(Lost("load torque over time", "the actuator load", by_callback=False))
    if not isinstance(scenario.command.output, FreeCommand):
        kind = scenario.command.output.type
        lost.append(Lost(f"motion of the output: {kind}", "an output that is free", by_callback=False))
    inertial = hanging.inertial(output)
    lost += hanging.lost
    limit = getattr(command, "torque_limit_nm", None)
    most = f' ctrllimited="true" ctrlrange="{-limit!r} {limit!r}"' if limit else ""
    name = quoteattr(scenario.name or "joint")
    if weigh:
        lost = list(weighing.weighed(lost))
    text = f"""<mujoco model={name}>
  <!--
{_table(lost)}
  -->
  <compiler angle="radian"/>
  <option timestep="{TIMESTEP_S!r}" integrator="implicitfast" gravity="0 0 {-hanging.gravity_m_per_s2!r}">
    <flag contact="disable"/>
  </option>
  <worldbody>
    <body name="motor">
      <joint name="motor" type="hinge" axis="{_AXIS}" damping="{viscous!r}" frictionloss="{coulomb!r}"
        solreffriction="{2 * TIMESTEP_S!r} 1" solimpfriction="0.9999 0.9999 0.001"/>
      {_inertial(motor)}
    </body>
    <body name="output">
      <joint name="output" type="hinge" axis="{_AXIS}"/>
      {inertial}
    </body>
  </worldbody>
  {coupling}
  <actuator>
    <motor name="motor" joint="motor"{most}/>
    <motor name="load" joint="output"/>
  </actuator>
</mujoco>
"""
    return text, tuple(lost)


def _inertial(inertia: float) -> str:
    """A body that is turned about its own centre."""
    return f'<inertial pos="0 0 0" mass="1" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'


def _tendon(number: int, band: float, stiffness: float, damping: float, ratio: float) -> str:
    """One spring between the joints; the first has the damping."""
    name = "drive" if number == 1 else f"drive_{number}"
    gap = f' springlength="{-band!r} {band!r}"' if band else ""
    damper = f' damping="{damping!r}"' if number == 1 else ""
    return (
        f'<fixed name="{name}" stiffness="{stiffness!r}"{damper}{gap}>'
        f'<joint joint="motor" coef="{1 / ratio!r}"/><joint joint="output" coef="-1"/></fixed>'
    )


class _Hanging:
    """What hangs on the output, as a mass on a lever: torque -(c cos q + s sin q) of the output's angle q.

    Attributes:
        inertia_kg_m2: of the load; of an arm its mean over the run.
        gravity_m_per_s2: acceleration of free fall.
        arm: c and s of an arm's gravity, its other joints as they stand at the start, N m.
        lost: what is said otherwise than in the scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        load, self.lost = scenario.load, []  # type: tuple[Any, list[Lost]]
        arms, self.inertia_kg_m2 = load.over(scenario.run.duration_s)
        self.gravity_m_per_s2 = load.gravity.gravity_m_per_s2 if load.gravity else STANDARD_GRAVITY
        self.arm = (0.0, 0.0)
        c = s = 0.0
        if load.gravity:
            angle = math.radians(load.gravity.hanging_angle_deg)
            moment = load.gravity.mass_kg * load.gravity.centre_of_mass_m * self.gravity_m_per_s2
            c, s = -moment * math.sin(angle), moment * math.cos(angle)
        if load.arm is not None:
            c_arm, s_arm = arms[-1].start[1:3]
            self.arm = (float(c_arm), float(s_arm))
            what = "arm: what its other joints do, and its inertia over their angles"
            self.lost.append(Lost(what, "its gravity as it stands at the start, its mean inertia"))
        c, s = c + self.arm[0], s + self.arm[1]
        # Mass times lever, kg m, and the angle at which it hangs.
        self._moment, self._angle = math.hypot(c, s) / self.gravity_m_per_s2, math.atan2(-c, s)
        self._lever = load.gravity.centre_of_mass_m if load.gravity and load.arm is None else math.inf

    def inertial(self, inertia: float) -> str:
        """The output's inertia about its axis and its centre of mass; z is up, the axis is y."""
        if not self._moment:
            return _inertial(inertia)
        # A mass of its own on its own lever where the inertia has room for it (Steiner).
        lever = self._lever
        if not self._moment * lever < inertia:
            lever = 0.5 * inertia / self._moment
            if math.isfinite(self._lever):
                told = f"{self._moment / lever:.4g} kg at {lever:.4g} m: the same moment and inertia"
                self.lost.append(Lost("gravity: a mass with more inertia than the load", told))
        own = inertia - self._moment * lever
        place = f"{lever * math.sin(self._angle)!r} 0 {-lever * math.cos(self._angle)!r}"
        mass = self._moment / lever
        return f'<inertial pos="{place}" mass="{mass!r}" diaginertia="{own!r} {own!r} {own!r}"/>'


def _table(lost: list[Lost]) -> str:
    """What was lost, for the comment in the file."""
    rows = []
    for one in lost:
        by = f"; the torque differs by {one.figure} (rms)" if one.share is not None else ""
        rows.append(f"  - {one.what}; here: {one.instead}{by}")
    rows = rows or ["  - nothing"]
    head = "  A joint by hdsim. Not as in the scenario (hdsim.export.mujoco.Rest brings most of it back):"
    return "\n".join([head, *rows]).replace("--", "- -")


class Rest:
    """What the file leaves out, as MuJoCo's callback of passive forces: ``mujoco.set_mjcb_passive(rest)``.

    It takes the place of the file's spring and damping: hdsim's own drive and effects follow the motion of
    the two joints, and give their torques back. Friction at the motor stays MuJoCo's, which holds a standing
    shaft; its size follows the transmitted torque. For integrators of one stage (``implicitfast``, as in the
    file).

    Args:
        scenario: the one that was exported.
        model: the ``mujoco.MjModel`` of the file, alone or within a larger model; its spring is taken out.
        prefix: of the joints' and the tendon's names, where the file was attached to another model.

    Attributes:
        output_torque_nm: torque of the drive on the output at the last call, N m.

    Raises:
        InputError: the mesh is rigid, so that nothing is passive.
    """

    def __init__(self, scenario: Scenario, model: Any, prefix: str = "") -> None:
        from hdsim.simulation.stepped import SteppedPlant

        if isinstance(scenario.drive.mesh, RigidMesh):
            raise InputError("a rigid mesh has no torque of its own: the file says it all but the effects")
        self._friction = scenario.drive.friction
        self._ratio = abs(scenario.drive.ratio)
        self._motor, self._output = (model.joint(prefix + name) for name in ("motor", "output"))
        frictionless = Friction(smoothing_velocity_rad_per_s=self._friction.smoothing_velocity_rad_per_s)
        drive = scenario.drive.model_copy(update={"friction": frictionless})
        # The file has the gravity; that of an arm is within all else that the arm does.
        load = scenario.load.model_copy(update={"gravity": None})
        self._arm = _Hanging(scenario).arm
        alone = scenario.model_copy(update={"drive": drive, "load": load})
        self._plant = SteppedPlant(alone, motor="motion", output="motion")
        springs = [k for k in range(model.ntendon) if model.tendon(k).name.startswith(prefix + "drive")]
        model.tendon_stiffness[springs] = 0.0
        model.tendon_damping[springs] = 0.0
        dof = self._motor.dofadr[0]
        model.dof_damping[dof] = self._friction.viscous_nm_s_per_rad
        self.output_torque_nm = 0.0
        self._last: tuple[float, Array] | None = None

    def __call__(self, model: Any, data: Any) -> None:
        """Add the drive's torques to ``data.qfrc_passive``."""
        at = [joint.qposadr[0] for joint in (self._motor, self._output)]
        dofs = [joint.dofadr[0] for joint in (self._motor, self._output)]
        angles, speeds, time = data.qpos[at].copy(), data.qvel[dofs], float(data.time)
        if self._last is None or time < self._last[0]:
            self._plant.reset()
        elif time > self._last[0]:
            before, start = self._last
            mean = (angles - start) / (time - before)
            self._plant.step(time - before, _motion(start, mean))
        self._last = time, angles
        self._plant.hold(_motion(angles, speeds))
        found = self._plant.values(["motor_torque", "load_torque", "output_torque"])
        self.output_torque_nm = found["output_torque"]
        c, s = self._arm
        twice = c * math.cos(angles[1]) + s * math.sin(angles[1])
        data.qfrc_passive[dofs] -= [found["motor_torque"], found["load_torque"] - twice]
        loaded = self._friction.load_coefficient * abs(self.output_torque_nm) / self._ratio
        model.dof_frictionloss[dofs[0]] = self._friction.coulomb_nm + loaded


def _motion(angles: Array, speeds: Array) -> dict[str, float]:
    """Inputs that move motor and output evenly."""
    found: dict[str, float] = {}
    for side, angle, speed in zip(("motor", "output"), angles.tolist(), speeds.tolist(), strict=True):
        found |= {f"prescribed_{side}_angle": angle, f"prescribed_{side}_velocity": speed}
    return found
