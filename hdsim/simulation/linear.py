"""The drive as a linear model around an operating point, and as a nonlinear block for ``control``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.scenario import loaded
from hdsim.simulation.operating_point import OperatingPoint as OperatingPoint
from hdsim.simulation.operating_point import find_operating_point as find_operating_point
from hdsim.simulation.plant import Plant
from hdsim.simulation.ports import INPUTS

if TYPE_CHECKING:
    from pathlib import Path

    import control

    from hdsim.scenario import Scenario
    from hdsim.simulation.inputs import MotorInput, OutputInput

Array = NDArray[np.float64]

#: What comes out unless something else is asked for.
OUTPUTS = (
    "motor_angle",
    "motor_velocity",
    "output_angle",
    "output_velocity",
    "output_torque",
    "transmission_error",
)


def linearize(
    scenario: Scenario | str | Path,
    *,
    operating_point: OperatingPoint | None = None,
    time: float = 0.0,
    inputs: tuple[str, ...] = INPUTS,
    outputs: tuple[str, ...] = OUTPUTS,
    hold_motor: bool = False,
) -> control.StateSpace:
    """Linearise a scenario's drive around an operating point, from the exact Jacobian of the simulation.

    Deviations dx' = A dx + B du, dy = C dx + D du. The scenario's motor command is left out: the torques are
    the inputs. States are absolute angles (rad) and velocities (rad/s) of motor, ring and output, then the
    effects' own; ``state_labels`` name them with units. Where the drive is not smooth (in a corner of the
    tabulated spring, at the edge of the gap) the derivative is the one on the side of the point.

    Args:
        scenario: the drive with effects and load, or its file.
        operating_point: from ``find_operating_point``; the balance under the scenario's own load torque when
            None.
        time: at which that load torque is read, s.
        inputs: among ``motor_torque`` and ``load_torque``, N m.
        outputs: among ``motor_angle``, ``motor_velocity``, ``output_angle``, ``output_velocity``,
            ``output_torque``, ``transmission_error`` and, for a ring with inertia, ``ring_angle`` and
            ``ring_velocity``; SI units.
        hold_motor: hold the motor at its angle: its two states and its torque are left out.

    Returns:
        A ``control.StateSpace`` with named inputs, outputs and states.

    Raises:
        InputError: an input or an output that there is not.
        PhysicsError: no operating point.
    """
    import control as ct

    scenario = loaded(scenario)
    if hold_motor:
        inputs = tuple(name for name in inputs if name != "motor_torque")
    for name in inputs:
        if name not in INPUTS:
            raise InputError(f"no input {name!r} of the drive; there are: {', '.join(INPUTS)}")
    plant = Plant(scenario, tuple(outputs))
    point = operating_point or find_operating_point(scenario, time=time)
    if len(point.states) != plant.size:
        raise InputError(
            f"an operating point of another drive: it has {len(point.states)} states, this one {plant.size}"
        )
    at = plant.derivatives(point.time, point.states, point.torques)
    T = plant.to_absolute()
    back = np.linalg.inv(T)
    A, B, C, D = T @ at.A @ back, T @ at.B, at.C @ back, at.D
    names = plant.state_names(absolute=True)
    if hold_motor:
        motor = plant.model.place_of["motor"]
        kept = [k for k in range(plant.size) if k not in (motor, motor + 1)]
        A, B, C = A[np.ix_(kept, kept)], B[kept], C[:, kept]
        names = [names[k] for k in kept]
    columns = [INPUTS.index(name) for name in inputs]
    return ct.ss(
        A,
        B[:, columns],
        C,
        D[:, columns],
        inputs=list(inputs),
        outputs=list(outputs),
        states=names,
        name=_name(scenario),
    )


def close_loop(scenario: Scenario, plant: control.StateSpace) -> control.StateSpace:
    """The linear drive with the scenario's controller around it.

    Args:
        scenario: its motor command must be a position or velocity loop with a continuous controller. The
            torque limit is not reached.
        plant: what ``linearize`` returns; must have ``motor_torque`` among its inputs, and angle and velocity
            of motor and output among its outputs.

    Returns:
        A model with the inputs ``reference_position`` (of a position loop), ``reference_velocity`` and
        ``reference_acceleration``, on the side of the trajectory, and the plant's other inputs. A
        feedforward reads the reference's derivatives as inputs of their own.

    Raises:
        InputError: the scenario has no controller, or a sampled one.
    """
    import control as ct

    from hdsim.actuation.canonical import INPUTS as READINGS

    command: Any = scenario.command.motor
    if not hasattr(command, "canonical"):
        raise InputError(f"the motor's command is {command.type!r}; only position and velocity close a loop")
    if command.sample_period_s is not None:
        raise InputError("the controller is sampled; leave sample_period_s out to linearise the loop")
    law = command.canonical(scenario.drive.ratio)
    references = list(READINGS[command.order : 3])
    # A velocity command has no reference angle, so its column is empty.
    used = [*references, *READINGS[3:]]
    columns = [READINGS.index(name) for name in used]
    controller = ct.ss(
        law.A,
        law.B[:, columns],
        law.C[None, :],
        law.D[None, columns],
        inputs=used,
        outputs=["motor_torque"],
        states=[f"controller_state_{k + 1}" for k in range(len(law.C))],
        name="controller",
    )
    others = [name for name in plant.input_labels if name != "motor_torque"]
    return ct.interconnect(
        [plant, controller],
        inputs=[*references, *others],
        outputs=list(plant.output_labels),
        states=[*plant.state_labels, *controller.state_labels],
        name=f"{plant.name}_closed",
    )


def io_system(
    scenario: Scenario | str | Path,
    *,
    dt_s: float | None = None,
    motor: MotorInput = "torque",
    output: OutputInput = "torque",
    outputs: tuple[str, ...] | None = None,
    time: float = 0.0,
) -> Any:
    """The nonlinear drive as a block for ``control.interconnect`` and ``control.input_output_response``.

    With ``dt_s`` it is a block in discrete time: a step of the compiled integrator from sample to sample,
    with inputs held between them, for controllers that are sampled too. Without, it is the compiled
    right-hand side in continuous time, which ``control`` integrates itself, and friction is smoothed as in
    ``linearize``; the block in discrete time sticks like a run. Both are driven by a motor torque and an
    external torque on the output instead of the scenario's command and load torque; in discrete time either
    side may be moved instead. The states are those of the simulation: ring and output as deviations
    from the ideal gear, so that tolerances mean the same after many turns.

    Args:
        scenario: the drive with effects, inertia and gravity, or its file.
        dt_s: time between two samples, s; continuous time when None.
        motor: input on the motor's side, as for ``SteppedPlant``; only ``torque`` in continuous time.
        output: input on the output's side: ``torque``, or ``motion``: ``prescribed_output_angle``,
            ``_velocity`` and ``_acceleration``; only ``torque`` in continuous time.
        outputs: as for ``linearize``, in discrete time any of ``SteppedPlant.outputs``; ``OUTPUTS``, as far
            as they are no inputs, when None.
        time: offset of the block's time against the scenario's, for a prescribed output, s.

    Returns:
        A ``control.NonlinearIOSystem`` with the inputs ``motor_torque`` and ``load_torque``, N m, or those of
        the motions, rad, rad/s and rad/s².

    Raises:
        InputError: an output that there is not, or a motion in continuous time.
    """
    scenario = loaded(scenario)
    chosen = OUTPUTS if outputs is None else tuple(outputs)
    if dt_s is not None:
        from hdsim.simulation.sampled_block import sampled_block

        if not 0.0 < dt_s < np.inf:
            raise InputError(f"dt_s: found {dt_s!r}, expected a positive time")
        return sampled_block(
            scenario, dt_s, motor=motor, output=output, outputs=chosen, time=time, name=_name(scenario)
        )
    if (motor, output) != ("torque", "torque"):
        raise InputError(
            "a side that is moved needs dt_s: the block in continuous time has torques as inputs"
        )
    import control as ct

    plant = Plant(scenario, chosen)

    def update(t: float, x: Array, u: Array, _: Any) -> Array:
        return plant.rates(time + t, np.asarray(x, dtype=float), np.asarray(u, dtype=float))

    def output_at(t: float, x: Array, u: Array, _: Any) -> Array:
        return plant.values(time + t, np.asarray(x, dtype=float), np.asarray(u, dtype=float))

    return ct.nlsys(
        update,
        output_at,
        inputs=list(INPUTS),
        outputs=list(chosen),
        states=plant.state_names(absolute=False),
        name=_name(scenario),
    )


def _name(scenario: Scenario) -> str:
    """The scenario's name as a block's: letters, digits and underscores."""
    return "".join(c if c.isalnum() else "_" for c in scenario.name) or "drive"
