"""Effects without a drive: what they contribute, and their kernels called as the assembly calls them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.kernel import (
    DISSIPATED,
    INPUT_FRICTION,
    MOTOR_TORQUE,
    MOTOR_VELOCITY,
    OUTPUT_TORQUE,
    OUTPUT_VELOCITY,
    OWN,
    STORED,
    TWIST_RATE,
    TWIST_TORQUE,
    Kernel,
    element,
)
from hdsim.parts import INPUT_FRICTION_HEAT, InputFriction, OddTooth, Part, State
from hdsim.testing import _calls

Array = NDArray[np.float64]

#: Rows of the outputs whose derivatives the contract asks for, own rates aside.
SMOOTH_ROWS = [row for row in range(OWN) if row < STORED]
assert STORED == 8
assert INPUT_FRICTION > STORED


@element
def base_friction(inputs: Any, parameters: Any, own: int, columns: int, outputs: Any, jacobian: Any) -> None:
    """The drive's own viscous friction. Parameter: b."""
    speed = inputs[MOTOR_VELOCITY]
    outputs[MOTOR_TORQUE] -= parameters[0] * speed
    jacobian[MOTOR_TORQUE * columns + MOTOR_VELOCITY] -= parameters[0]
    outputs[DISSIPATED] += parameters[0] * speed * speed
    jacobian[DISSIPATED * columns + MOTOR_VELOCITY] += 2.0 * parameters[0] * speed


class Collector:
    """``hdsim.parts.Builder`` as lists of what was handed in."""

    def __init__(
        self,
        ratio: float = -100.0,
        seed: int = 1,
        viscous: float = 3.5e-4,
        given: dict[str, int] | None = None,
    ) -> None:
        self.ratio = ratio
        self.rated_torque_nm = 52.0
        self.twist_sign = 1.0
        self.declared: list[InputFriction] = [InputFriction(0.0, viscous, 1.0)]
        self.input_frictions: Sequence[InputFriction] = ()
        self.given = given or {}
        self.seed = seed
        self.first: list[tuple[Kernel, list[float], int]] = []
        self.last: list[tuple[Kernel, list[float], int]] = []
        self.first_heat: list[str] = []
        self.last_heat: list[str] = []
        self.twists: list[tuple[Kernel, list[float]]] = []
        self.states: list[State] = []
        self.compliances: list[Callable[[Any], Any]] = []
        self.half_gap = 0.0
        self.gap_waves: list[tuple[float, float, float, float]] = []
        self.gap_growth = 0.0
        self.film_share = 0.0
        self.odd_teeth: list[OddTooth] = []
        self.moving_housing: tuple[int, float] | None = None
        self.sensors: dict[str, Any] = {}

    def element(
        self,
        kernel: Kernel,
        parameters: Any,
        *,
        states: Sequence[State] = (),
        last: bool = False,
        heat: str = "",
    ) -> int:
        """See ``hdsim.parts.Builder.element``."""
        own = OWN + len(self.states)
        self.states += states
        (self.last if last else self.first).append((kernel, [float(p) for p in parameters], own))
        (self.last_heat if last else self.first_heat).append(heat or f"element {len(self.first)}")
        return own

    def declare_input_friction(self, friction: InputFriction) -> None:
        """See ``hdsim.parts.Builder.declare_input_friction``."""
        self.declared.append(friction)

    def housing(self, own: int, inertia_kg_m2: float) -> None:
        """See ``hdsim.parts.Builder.housing``."""
        self.moving_housing = (own, inertia_kg_m2)

    def external(self, name: str) -> int | None:
        """See ``hdsim.parts.Builder.external``."""
        return self.given.get(name)

    def twist(self, kernel: Kernel, parameters: Any) -> None:
        """See ``hdsim.parts.Builder.twist``."""
        self.twists.append((kernel, [float(p) for p in parameters]))

    def series_compliance(self, wind_up: Callable[[Any], Any], *, play: bool = False) -> None:
        """See ``hdsim.parts.Builder.series_compliance``."""
        self.compliances.append(wind_up)

    def widen_gap(self, half_gap_rad: float) -> None:
        """See ``hdsim.parts.Builder.widen_gap``."""
        self.half_gap += half_gap_rad

    def wave_of_gap(self, amplitude_rad: float, by_motor: float, by_output: float, phase_rad: float) -> None:
        """See ``hdsim.parts.Builder.wave_of_gap``."""
        self.gap_waves.append((amplitude_rad, by_motor, by_output, phase_rad))

    def fill_gap(self, share: float) -> None:
        """See ``hdsim.parts.Builder.fill_gap``."""
        self.film_share = max(self.film_share, share)

    def grow_gaps(self, growth: float) -> None:
        """See ``hdsim.parts.Builder.grow_gaps``."""
        self.gap_growth += growth

    def odd_tooth(self, tooth: OddTooth) -> None:
        """See ``hdsim.parts.Builder.odd_tooth``."""
        self.odd_teeth.append(tooth)

    def signal(self, signal: Any) -> int:
        """See ``hdsim.parts.Builder.signal``."""
        raise NotImplementedError

    def state_index(self, name: str) -> int | None:
        """See ``hdsim.parts.Builder.state_index``."""
        return next((OWN + i for i, state in enumerate(self.states) if state.name == name), None)

    def sensor(self, channel: str, sensor: Any) -> None:
        """See ``hdsim.parts.Builder.sensor``."""
        self.sensors[channel] = sensor


class Alone:
    """The kernels of some effects, callable.

    Args:
        effects: the effects, or other parts.
        base: viscous friction that the drive has on its own, N m s/rad.
        options: of ``Collector``.
    """

    def __init__(self, *effects: Part, base: float = 0.0, **options: Any) -> None:
        # As in the assembly, friction of all parts is known after a first pass.
        before = Collector(viscous=base, **options)
        for effect in effects:
            effect.contribute(before)
        self.builder = build = Collector(viscous=base, **options)
        build.input_frictions = before.declared
        build.element(base_friction, [base], heat=INPUT_FRICTION_HEAT)
        for effect in effects:
            effect.contribute(build)
        self.columns = OWN + len(build.states)
        parts = build.first + build.last
        self._elements = self._packed([(kernel, numbers) for kernel, numbers, _ in parts])
        self._owns = np.array([own for _, _, own in parts])
        self._twists = self._packed(build.twists)

    @staticmethod
    def _packed(parts: list[tuple[Kernel, list[float]]]) -> tuple[Any, Any, Any]:
        addresses = np.array([kernel.address for kernel, _ in parts], dtype=np.int64)
        lengths = [len(numbers) for _, numbers in parts]
        offsets = np.concatenate(([0], np.cumsum(lengths)[:-1])).astype(np.int64)
        return addresses, offsets, np.array([x for _, numbers in parts for x in numbers], dtype=float)

    @property
    def initial(self) -> Array:
        """Inputs at rest, own states at their initial values."""
        inputs = np.zeros(self.columns)
        inputs[OWN:] = [state.initial for state in self.builder.states]
        return inputs

    def __call__(self, inputs: Array) -> tuple[Array, Array]:
        """Outputs (columns,) and Jacobian (columns, columns)."""
        outputs, jacobian = np.zeros(self.columns), np.zeros((self.columns, self.columns))
        addresses, offsets, numbers = self._elements
        flat = jacobian.reshape(-1)
        _calls.elements(addresses, offsets, self._owns, numbers, self.columns, inputs, outputs, flat)
        return outputs, jacobian

    def heats(self, inputs: Array) -> dict[str, float]:
        """Heat of every account, W."""
        found: dict[str, float] = {}
        addresses, offsets, numbers = self._elements
        for k, account in enumerate(self.builder.first_heat + self.builder.last_heat):
            outputs, jacobian = np.zeros(self.columns), np.zeros(self.columns**2)
            one = slice(k, k + 1)
            _calls.elements(
                addresses[one],
                offsets[one],
                self._owns[one],
                numbers,
                self.columns,
                inputs,
                outputs,
                jacobian,
            )
            found[account] = found.get(account, 0.0) + float(outputs[DISSIPATED])
        return found

    def powers(self, inputs: Array) -> float:
        """Sum of the sizes of all powers and heats of the elements, W."""
        total = 0.0
        addresses, offsets, numbers = self._elements
        for k in range(len(addresses)):
            outputs, jacobian = np.zeros(self.columns), np.zeros(self.columns**2)
            which = addresses[k : k + 1], offsets[k : k + 1], self._owns[k : k + 1]
            _calls.elements(*which, numbers, self.columns, inputs, outputs, jacobian)
            speeds = [inputs[c] for c in (MOTOR_VELOCITY, OUTPUT_VELOCITY, TWIST_RATE)]
            torques = [outputs[r] for r in (MOTOR_TORQUE, OUTPUT_TORQUE, TWIST_TORQUE)]
            total += abs(outputs[DISSIPATED]) + sum(abs(t * w) for t, w in zip(torques, speeds, strict=True))
        return total

    def error(self, motor_angle: float, output_angle: float) -> Array:
        """e, de/dm, de/do, d2e/dm2, d2e/dm do, d2e/do2."""
        result = np.zeros(6)
        addresses, offsets, numbers = self._twists
        if len(addresses):
            _calls.twists(addresses, offsets, numbers, motor_angle, output_angle, result)
        return result

    def follow(self, column: int, position: Any, speed: Any, times: Array, rtol: float = 1e-9) -> Any:
        """Own states, shape (states, n), while an angle column and its speed follow prescribed functions."""
        from scipy.integrate import solve_ivp

        def rate(t: float, own: Array) -> Array:
            inputs = self.initial
            inputs[column], inputs[column + 1], inputs[OWN:] = position(t), speed(t), own
            return self(inputs)[0][OWN:]

        scale = np.array([state.scale for state in self.builder.states])
        step = (times[-1] - times[0]) / 500
        solution = solve_ivp(
            rate,
            (times[0], times[-1]),
            self.initial[OWN:],
            "LSODA",
            times,
            rtol=rtol,
            atol=rtol * scale,
            max_step=step,
        )
        assert solution.success
        return solution.y
