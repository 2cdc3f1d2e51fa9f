"""Many joints advanced together: ``SteppedPlant`` with an axis of drives, for learning, for Monte Carlo."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdsim.drive import _layout as layout
from hdsim.errors import InputError
from hdsim.simulation import _rosenbrock as compiled
from hdsim.simulation._batch import observe_each, step_each
from hdsim.simulation.inputs import MotorInput, OutputInput
from hdsim.simulation.run import RunFailed
from hdsim.simulation.stepped import SteppedPlant, SteppedState

if TYPE_CHECKING:
    from hdsim.scenario import Scenario

Array = NDArray[np.float64]

#: Steps of the integrator between two looks at what they came to.
_STEPS = 64


@dataclass(frozen=True)
class _Workspace:
    """What one thread works on; its drives use it in turn."""

    scratch: Array
    counts: NDArray[np.int64]
    work: Array
    record: tuple[Array, Array, Array]


class SteppedPlants:
    """N joints of one build that differ in numbers and seeds, advanced together: inputs and outputs are (N,).

    Each goes through the same steps, to the last bit, as a ``SteppedPlant`` of its own.

    Args:
        scenarios: one for each drive; they differ in numbers, not in what there is (mesh, effects, commands).
        motor: see ``SteppedPlant``.
        output: see ``SteppedPlant``.
        threads: threads that share the drives; the compiled code runs without Python's lock.

    Attributes:
        inputs: name and unit of every input.
        outputs: name and unit of every output.
        about: one line on every input and output.

    Raises:
        InputError: no scenario, a drive that is built otherwise than the first, or what ``SteppedPlant``
            says.
    """

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        *,
        motor: MotorInput | None = None,
        output: OutputInput | None = None,
        threads: int = 1,
    ) -> None:
        if not scenarios:
            raise InputError("a batch needs at least one scenario")
        if threads < 1:
            raise InputError(f"threads: found {threads}, expected at least 1")
        self._scenarios = list(scenarios)
        self._choice: dict[str, Any] = {"motor": motor, "output": output}
        plants = [self._single(k) for k in range(len(self))]
        first = self._first = plants[0]
        system = first.model.system
        for k, plant in enumerate(plants):
            own = plant.model.system
            same = np.array_equal(own.integers, system.integers) and own.reals.shape == system.reals.shape
            if not same or own.kernel.address != system.kernel.address:
                raise InputError(
                    f"drive {k} of the batch is built otherwise than the first: drives may differ in "
                    "numbers, not in mesh, effects and commands"
                )
        self.inputs, self.outputs, self.about = first.inputs, first.outputs, first.about
        self._reals = np.stack([plant.model.system.reals for plant in plants])
        self._start = np.stack([plant.state.y for plant in plants])
        self._y = self._start.copy()
        self._atol = np.stack([np.broadcast_to(plant.atol, plant.state.y.shape) for plant in plants])
        self._longest = np.array([plant.longest_step_s for plant in plants])
        self._rtol = np.array([plant.rtol for plant in plants])
        self._time, self._inside, self._step = (np.zeros(len(self)) for _ in range(3))
        self._held = {name: np.zeros(len(self)) for name in self.inputs}
        self._spaces = [self._workspace() for _ in range(min(threads, len(self)))]
        self.reset()

    def __len__(self) -> int:
        return len(self._scenarios)

    @property
    def time_s(self) -> Array:
        """Time that each drive has reached, shape (N,), s."""
        return self._time.copy()

    def reset(self, which: ArrayLike | None = None) -> None:
        """Put drives back to their scenarios' start, with all inputs zero.

        Args:
            which: their numbers, or N times true or false; all when None.
        """
        chosen = np.arange(len(self)) if which is None else np.arange(len(self))[np.asarray(which)]
        self._y[chosen] = self._start[chosen]
        self._time[chosen] = self._step[chosen] = 0.0
        for held in self._held.values():
            held[chosen] = 0.0
        self._set({}, None)

    def step(self, dt_s: float, inputs: Mapping[str, Any] | None = None) -> None:
        """Advance all drives.

        Args:
            dt_s: by how much, s.
            inputs: by name, a number for all or shape (N,); one that is not named keeps its last value. A
                torque may be a tuple of two: its values at the begin and at the end of the step.

        Raises:
            InputError: an input that there is not or that is not finite, another shape, a step that is not
                positive.
            RunFailed: the integration of a drive stopped within the step; all stay at its begin.
        """
        if not (0.0 < dt_s < math.inf):
            raise InputError(f"step: found {dt_s!r} s, expected a positive time")
        last = self._set(inputs or {}, dt_s)
        system = self._first.model.system
        end = self._time + dt_s
        y = self._y.copy()
        nothing = np.zeros(len(self))
        rows = (self._time, end, self._step, self._longest, self._rtol, nothing, nothing)
        control = np.column_stack(rows)
        statuses = np.full(len(self), compiled.FINISHED)
        guard = self._first.guard

        def advance(drives: NDArray[np.int64], space: _Workspace) -> None:
            step_each(
                drives, system.kernel.address, system.integers, self._reals, space.scratch, y, self._atol,
                control, space.counts, space.work, *space.record, layout.INSIDE,
                -1 if guard is None else guard.index, math.inf if guard is None else guard.limit, statuses,
            )  # fmt: skip

        shares = np.array_split(np.arange(len(self)), len(self._spaces))
        if not system.size:
            pass  # both sides are moved: nothing is left to integrate
        elif len(shares) == 1:
            advance(shares[0], self._spaces[0])
        else:
            with ThreadPoolExecutor(len(shares)) as pool:
                list(pool.map(advance, shares, self._spaces))
        failed = np.flatnonzero(statuses != compiled.FINISHED)
        if len(failed):
            self._fail(int(failed[0]), dt_s, inputs or {})
        self._y, self._time, self._step, self._held = y, end, control[:, compiled.STEP].copy(), last

    def hold(self, inputs: Mapping[str, ArrayLike]) -> None:
        """Set inputs without advancing: ``values`` tells at once what follows from them.

        Raises:
            InputError: as ``step``.
        """
        self._held = self._set(inputs, None)

    def values(self, names: Sequence[str] | None = None) -> dict[str, Array]:
        """Outputs where the drives are, shape (N,) each; all when None.

        Raises:
            InputError: an output that there is not.
        """
        formulas = self._first.formulas
        chosen = list(self.outputs) if names is None else list(names)
        for name in chosen:
            if name not in self.outputs:
                raise InputError(f"no output {name!r}; there are: {', '.join(self.outputs)}")
        places = np.array([p for name in chosen for p in formulas[name].places], dtype=np.int64)
        rows = np.empty((len(self), len(places)))
        system = self._first.model.system
        observe_each(
            system.kernel.address, self._time, self._y, system.integers, self._reals, self._inside,
            self._spaces[0].scratch, places, rows,
        )  # fmt: skip
        columns = iter(np.ascontiguousarray(rows.T))
        return {name: formulas[name].of(*(next(columns) for _ in formulas[name].places)) for name in chosen}

    def _single(self, k: int) -> SteppedPlant:
        """Drive k by itself, at its start."""
        return SteppedPlant(self._scenarios[k], **self._choice)

    def _workspace(self) -> _Workspace:
        """Arrays for one thread."""
        system = self._first.model.system
        n = system.size
        counts = np.zeros(compiled.COUNTS_SIZE + n, dtype=np.int64)
        counts[compiled.SIZE], counts[compiled.QUADRATURES] = n, system.quadratures
        record = np.empty(_STEPS + 1), np.empty((_STEPS + 1, n)), np.empty((_STEPS, 2, n))
        work = np.empty(compiled.work_size(n, system.quadratures))
        return _Workspace(np.zeros(max(1, system.scratch_size)), counts, work, record)

    def _set(self, inputs: Mapping[str, Any], dt_s: float | None) -> dict[str, Array]:
        """Write the inputs into the models; returns their values at the step's end."""
        last = dict(self._held)
        begin, slopes = dict(last), {}
        for name, course in inputs.items():
            if name not in self.inputs:
                raise InputError(f"no input {name!r}; there are: {', '.join(self.inputs)}")
            pair = isinstance(course, tuple)
            if pair and not name.endswith("_torque"):
                raise InputError(f"{name}: found a pair; only a torque goes in a straight line by itself")
            begin[name], last[name] = (self._each(name, c) for c in (course if pair else (course, course)))
            if pair:
                slopes[name] = np.zeros(len(self)) if dt_s is None else (last[name] - begin[name]) / dt_s
        for given, (start, row) in self._first.places:
            numbers = [begin[name] for name in given.names]
            if given.names[0] in slopes:
                numbers = [begin[given.names[0]], slopes[given.names[0]]]
            self._reals[:, start] = self._time
            self._reals[:, row : row + 4] = 0.0
            for power, number in enumerate(numbers):
                self._reals[:, row + power] = number / math.factorial(power)
        self._inside = self._time + 0.5 * (dt_s or 0.0)
        return last

    def _each(self, name: str, given: Any) -> Array:
        """An input of every drive, shape (N,).

        Raises:
            InputError: it has another shape, or is not finite.
        """
        found = np.asarray(given, dtype=np.float64)
        if found.shape not in ((), (len(self),)):
            raise InputError(f"{name}: found shape {found.shape}, expected a number or ({len(self)},)")
        if not np.isfinite(found).all():
            raise InputError(f"{name}: found numbers that are not finite")
        return np.array(np.broadcast_to(found, (len(self),)))

    def _fail(self, k: int, dt_s: float, inputs: Mapping[str, Any]) -> None:
        """Raise what drive k by itself says of the step.

        Raises:
            RunFailed: always.
        """
        plant = self._single(k)
        held = {name: float(values[k]) for name, values in self._held.items()}
        plant.reset(SteppedState(float(self._time[k]), self._y[k], float(self._step[k]) or None, held))
        one = {
            name: tuple(float(self._each(name, c)[k]) for c in course)
            if isinstance(course, tuple)
            else float(self._each(name, course)[k])
            for name, course in inputs.items()
        }
        try:
            plant.step(dt_s, one)  # type: ignore[arg-type]
        except RunFailed as error:
            raise RunFailed(f"drive {k}: {error}") from None
        raise RunFailed(f"drive {k}: the step was not finished")
