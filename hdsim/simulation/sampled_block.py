"""The drive as a discrete-time block of ``control``: between two samples the compiled integrator works."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.simulation.failures import state_names
from hdsim.simulation.inputs import MotorInput, OutputInput
from hdsim.simulation.stepped import SteppedPlant, SteppedState

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: Outputs that are kept for the next question.
_KEPT = 8


def sampled_block(
    scenario: Scenario,
    dt_s: float,
    *,
    motor: MotorInput,
    output: OutputInput,
    outputs: tuple[str, ...],
    time: float,
    name: str,
) -> Any:
    """A ``control.NonlinearIOSystem`` in discrete time; see ``hdsim.simulation.linear.io_system``.

    x[k + 1] is where ``SteppedPlant.step(dt_s)`` comes from x[k] with the inputs u[k] held; y[k] are the
    outputs at x[k] under u[k]. Beside the model's states x has the size of the integrator's next own step:
    with it a step depends on nothing but x and u.

    Raises:
        InputError: an output that there is not.
    """
    import control as ct

    plant = SteppedPlant(scenario, motor=motor, output=output)
    for one in outputs:
        if one not in plant.outputs:
            raise InputError(f"no output {one!r} of the drive; there are: {', '.join(plant.outputs)}")
    inputs = list(plant.inputs)
    # Torques act on what is read by way of the states alone, a motion at once.
    at_once = "motion" in (motor, output) or not {"motor_torque", "load_torque"}.isdisjoint(outputs)
    # ``control`` asks six times for the outputs of a sample in a loop: for each pass over the algebraic
    # connections, and again for the states.
    known: dict[bytes, Array] = {}

    def at(t: float, x: Array, u: Array) -> None:
        """Put the plant where x is, with its inputs."""
        given = dict(zip(inputs, np.asarray(u, dtype=float).tolist(), strict=True))
        y = np.array(x[:-1], dtype=float)
        plant.reset(SteppedState(time + float(t), y, float(x[-1]) or None, given))

    def update(t: float, x: Array, u: Array, _: Any) -> Array:
        at(t, x, u)
        plant.step(dt_s)
        return np.append(plant.state.y, plant.state.step_s or 0.0)

    def output_at(t: float, x: Array, u: Array, _: Any) -> Array:
        numbers = [x, u, np.array([t])] if at_once else [x, np.array([t])]
        key = np.concatenate(numbers).tobytes()
        if key not in known:
            if len(known) >= _KEPT:
                known.clear()
            at(t, x, u)
            known[key] = np.array(list(plant.values(outputs).values()))
        return known[key].copy()

    return ct.nlsys(
        update,
        output_at,
        inputs=inputs,
        outputs=list(outputs),
        states=[*state_names(plant.model), "integrator_step (s)"],
        dt=dt_s,
        name=name,
    )
