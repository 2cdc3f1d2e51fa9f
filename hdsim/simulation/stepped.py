"""A scenario's joint advanced step by step, with inputs from outside: for co-simulation and one's own loops.

The model is that of a run, and within a step the compiled integrator of the runs (``rodas4``) chooses its own
steps; what is commanded over time in the scenario is an input here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.drive import _layout as layout
from hdsim.drive.model import Model
from hdsim.errors import InputError
from hdsim.simulation.channels import Observer
from hdsim.simulation.failures import speed_guard, told
from hdsim.simulation.inputs import MotorInput, OutputInput, motor_given, output_given
from hdsim.simulation.rosenbrock import rodas4_through
from hdsim.simulation.run import RunFailed

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: An input over a step: held, or from a first to a last value in a straight line.
Course = float | tuple[float, float]


@dataclass(frozen=True)
class SteppedState:
    """Everything that the next step depends on.

    Args:
        time_s: time that has been reached, s.
        y: state vector of the model, shape (n,).
        step_s: size of the integrator's next own step, s; None before the first.
        held: last value of every input.
    """

    time_s: float
    y: Array
    step_s: float | None
    held: Mapping[str, float]


class SteppedPlant:
    """A scenario as a plant with inputs: ``step`` advances it, ``values`` tells where it is.

    Inputs are held over a step. A torque may go in a straight line instead, and an angle goes on with the
    velocity and the acceleration that are given with it. The same steps from a state give the same bits.

    Sensors (effect ``sensors``) are left out: outputs are the true channels.

    Args:
        scenario: drive, effects, inertia, gravity and arm of the load, controller, start, tolerances. The
            command's trajectories and the load torque over time are left out; an arm's other joints move as
            it says, and stand where they are at the end of its ``run.duration_s``.
        motor: ``torque`` (input ``motor_torque``); ``angle`` or ``velocity`` (inputs ``commanded_...`` of the
            scenario's controller, at the side of its trajectory); ``motion`` (``prescribed_motor_...``). What
            the scenario's motor command is when None.
        output: ``torque`` (input ``load_torque``) or ``motion`` (``prescribed_output_...``). What the
            scenario's output does when None.

    Attributes:
        inputs: name and unit of every input.
        outputs: name and unit of every output; those of ``Observer.formulas`` that are no input.
        about: one line on every input and output.
        formulas: how every output follows from the compiled code's numbers.
        places: the inputs, and where their numbers stand in the model's.
        rtol: relative tolerance.
        atol: absolute tolerance, a number or shape (n,).
        longest_step_s: longest step of the integrator, s.
        guard: the speed that gives a step up.

    Raises:
        InputError: the scenario has no such command, or its controller is sampled.
    """

    def __init__(
        self, scenario: Scenario, *, motor: MotorInput | None = None, output: OutputInput | None = None
    ) -> None:
        self._given = [motor_given(scenario, motor), output_given(scenario, output)]
        # An arm's other joints move as the scenario says: they are part of what hangs on the output.
        untouched = scenario.load.model_copy(update={"torque": None})
        loads, inertia = untouched.over(scenario.run.duration_s)
        parts = [*scenario.effects.active().values(), *loads]
        parts += [one.part for one in self._given if one.part is not None]
        self.model = Model(
            scenario.drive,
            parts,
            load_inertia_kg_m2=inertia,
            motions={one.axis: one.signal for one in self._given if one.axis},
            seed=scenario.run.seed,
            audited=False,
        )
        self._observer = Observer(self.model)
        self.guard = speed_guard(self.model)
        self.places = [(one, one.place(self.model)) for one in self._given]
        self.rtol = scenario.run.rtol
        atol = scenario.run.atol
        self.atol = self.rtol * self.model.system.scale if atol is None else atol
        self.longest_step_s = math.inf if scenario.run.max_step_s is None else scenario.run.max_step_s
        start = scenario.run.start
        y0 = self.model.initial_state(
            motor_angle=start.motor_angle_rad,
            motor_velocity=start.motor_velocity_rad_per_s,
            output_twist=start.output_twist_rad,
        )
        self.inputs = {name: unit for one in self._given for name, unit in one.units.items()}
        self.formulas = {n: f for n, f in self._observer.formulas.items() if n not in self.inputs}
        self.outputs = {name: formula.unit for name, formula in self.formulas.items()}
        self.about = {name: about for one in self._given for name, about in one.told.items()}
        self.about |= {name: formula.description for name, formula in self.formulas.items()}
        self._start = SteppedState(0.0, y0, None, dict.fromkeys(self.inputs, 0.0))
        self.reset()

    @property
    def time_s(self) -> float:
        """Time that has been reached, s."""
        return self._time

    @property
    def state(self) -> SteppedState:
        """Everything that the next step depends on, to come back to by ``reset``."""
        return SteppedState(self._time, self._y.copy(), self._step, dict(self._held))

    def reset(self, state: SteppedState | None = None) -> None:
        """Go to a state of this plant; to the scenario's start, with all inputs zero, when None."""
        state = self._start if state is None else state
        if state.y.shape != self._start.y.shape:
            raise InputError(f"found a state of shape {state.y.shape}, the plant has {self._start.y.shape}")
        self._time, self._y, self._step = state.time_s, state.y.copy(), state.step_s
        self._held = dict(state.held)
        self._set({}, None)

    def step(self, dt_s: float, inputs: Mapping[str, Course] | None = None) -> None:
        """Advance.

        Args:
            dt_s: by how much, s.
            inputs: by name; one that is not named keeps its last value. A torque may be a pair: its values at
                the begin and at the end of the step.

        Raises:
            InputError: an input that there is not, a number that is not finite, a step that is not positive.
            RunFailed: the integration stopped within the step; the plant stays at its begin.
        """
        if not (0.0 < dt_s < math.inf):
            raise InputError(f"step: found {dt_s!r} s, expected a positive time")
        last = self._set(inputs or {}, dt_s)
        t0, t1 = self._time, self._time + dt_s
        system = self.model.system
        found = rodas4_through(
            system,
            np.array([t0, t1]),
            self._y,
            np.zeros(0),
            rtol=self.rtol,
            atol=self.atol,
            inside_at=layout.INSIDE,
            guard=self.guard,
            first_step=self._step,
            max_step=self.longest_step_s,
        )
        if not found.success:
            raise RunFailed(told(self.model, found))
        self._time, self._y, self._step = t1, found.y_end, found.next_step
        self._held = last

    def hold(self, inputs: Mapping[str, float]) -> None:
        """Set inputs without advancing: ``values`` tells at once what follows from them.

        Raises:
            InputError: as ``step``.
        """
        self._held = self._set(inputs, None)

    def values(self, names: Sequence[str] | None = None) -> dict[str, float]:
        """Outputs where the plant is; all when None.

        Raises:
            InputError: an output that there is not.
        """
        chosen = list(self.outputs) if names is None else list(names)
        # What jumps between two steps has not jumped yet.
        inside = np.array([self._inside])
        found = self._observer.values(chosen, np.array([self._time]), self._y[None, :], inside)
        return {name: float(found[name][0]) for name in chosen}

    def _set(
        self, inputs: Mapping[str, Course] | Mapping[str, float], dt_s: float | None
    ) -> dict[str, float]:
        """Write the inputs into the model; returns their values at the step's end."""
        last = dict(self._held)
        slopes: dict[str, float] = {}
        for name, course in inputs.items():
            if name not in self.inputs:
                raise InputError(f"no input {name!r}; there are: {', '.join(self.inputs)}")
            first, end = course if isinstance(course, tuple) else (course, course)
            if not (math.isfinite(first) and math.isfinite(end)):
                raise InputError(f"{name}: found {course!r}, expected finite numbers")
            if isinstance(course, tuple):
                if not name.endswith("_torque"):
                    raise InputError(f"{name}: found a pair; only a torque goes in a straight line by itself")
                slopes[name] = 0.0 if dt_s is None else (end - first) / dt_s
            last[name] = end
        reals = self.model.system.reals
        for given, (start, row) in self.places:
            numbers = [last[name] for name in given.names]
            name = given.names[0]
            if name in slopes:
                course = inputs[name]
                assert isinstance(course, tuple)
                numbers = [course[0], slopes[name]]
            reals[start] = self._time
            reals[row : row + 4] = 0.0
            for power, number in enumerate(numbers):
                reals[row + power] = number / math.factorial(power)
        self._inside = self._time + 0.5 * (dt_s or 0.0)
        return last
