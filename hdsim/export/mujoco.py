"""A scenario's joint as MJCF for MuJoCo 4 (https://mujoco.readthedocs.io), and the rest as its callback.

Two hinges, ``motor`` and ``output``, coupled by a fixed tendon of length motor angle / ratio - output angle,
the twist: its spring is an odd cubic fitted to hdsim's own torque over twist, with a dead band for play. What
the format cannot say is in a table, and ``Rest`` computes it while MuJoCo simulates.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from hdsim.actuation.command import FreeCommand, TorqueCommand
from hdsim.drive.contributed import Contributed
from hdsim.drive.parameters import Friction, RigidMesh
from hdsim.errors import InputError

if TYPE_CHECKING:
    from hdsim.actuation.loads import GravityArm
    from hdsim.parts import Effect
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: Step of the exported model, s; a drive's own resonances, motor locked, lie below 1 kHz.
TIMESTEP_S = 1e-4
#: Twists at which the spring is fitted, up to that of rated torque.
_POINTS = 40
_AXIS = "0 1 0"


@dataclass(frozen=True)
class Lost:
    """Something of a scenario that the file says otherwise, or not at all.

    Args:
        what: of the scenario.
        instead: what the file has in its place.
        by_callback: whether ``Rest`` brings it back.
    """

    what: str
    instead: str
    by_callback: bool = True


class _Probe(Contributed):
    """Finds out what an effect adds to a model."""

    def __init__(self, scenario: Scenario, effect: Effect) -> None:
        super().__init__()
        self.ratio, self.rated_torque_nm = scenario.drive.ratio, scenario.drive.rated_torque_nm
        self.seed = scenario.run.seed
        effect.contribute(self)
        self.frictions = self._given.input_frictions
        self.only_spring = not (self._given.elements or self._given.twists or self._given.sensors)
        self.only_friction = len(self._given.elements) == len(self.frictions) == 1 and not self._given.twists


@dataclass(frozen=True)
class Spring:
    """torque = k s + c s^3 of s, the twist less a dead band of +- half_gap_rad.

    Args:
        stiffness: k, N m/rad.
        cubic: c, N m/rad^3.
        half_gap_rad: at the output.
        error: rms deviation from hdsim's torque over its rms.
    """

    stiffness: float
    cubic: float
    half_gap_rad: float
    error: float


def export_mujoco(scenario: Scenario, out: str | Path) -> tuple[Lost, ...]:
    """Write a scenario's joint as MJCF.

    Args:
        scenario: the joint.
        out: the file, ``.xml``.

    Returns:
        What the file does not hold; it is in the file, too, as a comment.

    Raises:
        InputError: ``out`` cannot be written.
    """
    text, lost = mjcf(scenario)
    out = Path(out)
    partial = out.with_name(out.name + ".partial")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror})") from error
    return lost


def mjcf(scenario: Scenario) -> tuple[str, tuple[Lost, ...]]:
    """A scenario's joint as MJCF, and what that leaves out."""
    drive, load = scenario.drive, scenario.load
    lost: list[Lost] = []
    frictions = [(drive.friction.coulomb_nm, drive.friction.viscous_nm_s_per_rad)]
    for name, effect in scenario.effects.active().items():
        probe = _Probe(scenario, effect)
        if probe.only_friction:
            frictions += [(f.coulomb_nm, f.viscous_nm_s_per_rad) for f in probe.frictions]
        elif not probe.only_spring:
            sensors = name == "sensors"
            lost.append(Lost(f"effect {name}: {effect.title}", "nothing", by_callback=not sensors))
    if drive.friction.load_coefficient > 0:
        lost.append(Lost("friction that grows with the load", "friction without load"))
    coulomb, viscous = (sum(column) for column in zip(*frictions, strict=True))
    motor = drive.inertia.motor_kg_m2 + drive.inertia.wave_generator_kg_m2
    with_output = drive.arrangement == "circular_spline_fixed"
    output = load.inertia_kg_m2 + (drive.inertia.ring_kg_m2 if with_output else 0.0)
    if isinstance(drive.mesh, RigidMesh):
        coupling = (
            '<equality><joint name="drive" joint1="output" joint2="motor" '
            f'polycoef="0 {1 / drive.ratio!r} 0 0 0" '
            f'solref="{3 * TIMESTEP_S!r} 1" solimp="0.9999 0.9999 0.001"/></equality>'
        )
    else:
        spring = fitted_spring(scenario)
        lost.append(
            Lost(
                "stiffness over the torque, as hdsim has it",
                f"a cubic of the twist, {100 * spring.error:.1f} % rms off up to rated torque",
            )
        )
        if drive.mesh.model != "lumped":
            lost.append(Lost("teeth: their own inertia, gaps and forces over the turn", "a spring"))
        half = spring.half_gap_rad
        gap = f' springlength="{-half!r} {half!r}"' if half else ""
        coupling = (
            f'<tendon><fixed name="drive" stiffness="{spring.stiffness!r} 0 {spring.cubic!r}" '
            f'damping="{drive.torsion.damping_nm_s_per_rad!r}"{gap}>'
            f'<joint joint="motor" coef="{1 / drive.ratio!r}"/>'
            '<joint joint="output" coef="-1"/></fixed></tendon>'
        )
        if half and drive.torsion.damping_nm_s_per_rad:
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
    gravity, inertial = 9.80665, _inertial(output)
    arm = load.gravity
    if arm is not None and _own_inertia(arm, output) > 0:
        gravity, inertial = arm.gravity_m_per_s2, _arm(arm, output)
    elif arm is not None:
        lost.append(Lost("gravity: the arm has more inertia than the load", "nothing"))
    limit = getattr(command, "torque_limit_nm", None)
    most = f' ctrllimited="true" ctrlrange="{-limit!r} {limit!r}"' if limit else ""
    name = quoteattr(scenario.name or "joint")
    text = f"""<mujoco model={name}>
  <!--
{_table(lost)}
  -->
  <compiler angle="radian"/>
  <option timestep="{TIMESTEP_S!r}" integrator="implicitfast" gravity="0 0 {-gravity!r}">
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


def fitted_spring(scenario: Scenario) -> Spring:
    """MuJoCo's spring by least squares on hdsim's torque over twist, motor held, output turned slowly."""
    from scipy.optimize import nnls

    from hdsim.simulation.stepped import SteppedPlant

    drive = scenario.drive
    plain = scenario.model_copy(update={"effects": type(scenario.effects)(**_springs(scenario))})
    plant = SteppedPlant(plain, motor="motion", output="motion")

    def torque(twist: float) -> float:
        plant.hold({"prescribed_output_angle": -twist})
        return plant.values(["output_torque"])["output_torque"]

    reach = drive.rated_torque_nm / drive.torsion.stiffness_k3_nm_per_rad
    while torque(reach) < drive.rated_torque_nm:
        reach *= 1.1
    low, high = 0.0, reach
    while high - low > 1e-7 * reach:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if torque(middle) <= 1e-9 * drive.rated_torque_nm else (low, middle)
    half_gap = low if low > 1e-6 * reach else 0.0
    twists = half_gap + (reach - half_gap) * np.arange(1, _POINTS + 1) / _POINTS
    torques = np.array([0.5 * (torque(twist) - torque(-twist)) for twist in twists])
    s = (twists - half_gap) / (reach - half_gap)
    basis = np.column_stack([s, s**3])
    # None below zero: beyond the points the spring must not give way.
    found, _ = nnls(basis / torques[:, None], np.ones(_POINTS))
    error = float(np.linalg.norm(basis @ found - torques) / np.linalg.norm(torques))
    first, cubic = found.tolist()
    return Spring(first / (reach - half_gap), cubic / (reach - half_gap) ** 3, half_gap, error)


def _springs(scenario: Scenario) -> dict[str, Effect]:
    """The effects that do nothing but change the spring."""
    active = scenario.effects.active().items()
    return {name: effect for name, effect in active if _Probe(scenario, effect).only_spring}


def _inertial(inertia: float) -> str:
    """A body that is turned about its own centre."""
    return f'<inertial pos="0 0 0" mass="1" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'


def _own_inertia(arm: GravityArm, inertia: float) -> float:
    """Inertia about the arm's own centre of mass, kg m^2 (Steiner)."""
    return inertia - arm.mass_kg * arm.centre_of_mass_m**2


def _arm(arm: GravityArm, inertia: float) -> str:
    """A body whose centre of mass points down at the hanging angle; z is up, the axis is y."""
    hanging, length = math.radians(arm.hanging_angle_deg), arm.centre_of_mass_m
    place = f"{length * math.sin(hanging)!r} 0 {-length * math.cos(hanging)!r}"
    own = _own_inertia(arm, inertia)
    return f'<inertial pos="{place}" mass="{arm.mass_kg!r}" diaginertia="{own!r} {own!r} {own!r}"/>'


def _table(lost: list[Lost]) -> str:
    """What was lost, for the comment in the file."""
    rows = [f"  - {one.what}; here: {one.instead}" for one in lost] or ["  - nothing"]
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
        load = scenario.load
        arm = load.gravity
        if arm is not None and _own_inertia(arm, load.inertia_kg_m2) > 0:
            load = load.model_copy(update={"gravity": None})
        alone = scenario.model_copy(update={"drive": drive, "load": load})
        self._plant = SteppedPlant(alone, motor="motion", output="motion")
        tendon = model.tendon(prefix + "drive").id
        for numbers in (model.tendon_stiffness, model.tendon_stiffnesspoly, model.tendon_damping):
            numbers[tendon] = 0.0
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
        data.qfrc_passive[dofs] -= [found["motor_torque"], found["load_torque"]]
        loaded = self._friction.load_coefficient * abs(self.output_torque_nm) / self._ratio
        model.dof_frictionloss[dofs[0]] = self._friction.coulomb_nm + loaded


def _motion(angles: Array, speeds: Array) -> dict[str, float]:
    """Inputs that move motor and output evenly."""
    found: dict[str, float] = {}
    for side, angle, speed in zip(("motor", "output"), angles.tolist(), speeds.tolist(), strict=True):
        found |= {f"prescribed_{side}_angle": angle, f"prescribed_{side}_velocity": speed}
    return found
