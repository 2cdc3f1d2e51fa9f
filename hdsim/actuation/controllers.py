"""Controllers as a scenario writes them.

Gains are in N m at the motor shaft per unit of the error at the fed-back side; the sign of the ratio is
taken care of, so that positive gains always mean negative feedback.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field, model_validator

from hdsim.actuation.canonical import Loop, integrator, low_pass
from hdsim.parts import Parameters

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

InputName = Literal[
    "reference_position",
    "reference_velocity",
    "reference_acceleration",
    "motor_angle",
    "motor_velocity",
    "output_angle",
    "output_velocity",
]


class Controller(Parameters):
    """Base of the controllers: no anti-windup.

    Class attributes:
        commands: what one of another package can follow; hdsim's own are listed in ``choice.py``.
    """

    commands: ClassVar[tuple[str, ...]] = ("position", "velocity")

    def system(self, loop: Loop) -> Any:
        """Its ``control.StateSpace`` from w to the motor torque."""
        raise NotImplementedError

    def tracking_gain(self, C: Array, integrators: Any) -> Array:
        """L (n,) of the back-calculation."""
        import numpy as np

        return np.zeros(len(C))

    @property
    def clamps(self) -> bool:
        """Whether a sampled version stops its integrators while the torque is limited."""
        return False


class _Integrating(Controller):
    """Anti-windup by back-calculation.

    Source: Astrom and Hagglund (1995), PID Controllers: Theory, Design, and Tuning, 2nd ed., sec. 3.5.
    """

    anti_windup: bool = True
    """Keep the integral from growing while the torque is limited: by back-calculation in a continuous
    controller, by stopping the integral in a sampled one."""
    anti_windup_time_s: float | None = Field(None, gt=0.0)
    """Tracking time of the back-calculation; when left out T_i (sqrt(T_i T_d) with a derivative). Unit s."""

    def natural_tracking_time(self) -> float:
        """Tracking time in s when the user gives none."""
        raise NotImplementedError

    def tracking_gain(self, C: Array, integrators: Any) -> Array:
        """1 / T_t on the integral, in the units of the torque; 0 elsewhere."""
        import numpy as np

        gain = np.zeros(len(C))
        if self.anti_windup and integrators.any():
            gain[integrators] = 1.0 / (
                C[integrators] * (self.anti_windup_time_s or self.natural_tracking_time())
            )
        return gain

    @property
    def clamps(self) -> bool:
        """Whether a sampled version stops its integral."""
        return self.anti_windup


class _PID(_Integrating):
    """u = k_p e + k_i integral(e) + k_d e' (through a first-order filter if given) + feedforward."""

    def gains(self) -> tuple[float, float, float, float]:
        """k_p, k_i, k_d and the filter's time constant in s, 0 for none."""
        raise NotImplementedError

    def natural_tracking_time(self) -> float:
        """T_i, or sqrt(T_i T_d)."""
        proportional, integral, derivative, _ = self.gains()
        return math.sqrt(derivative / integral) if derivative > 0.0 else proportional / integral

    def system(self, loop: Loop) -> Any:
        """Sum of the three terms; the derivative of an angle is its velocity, which is measured."""
        proportional, integral, derivative, filter_time = self.gains()
        side = loop.feedback
        error = loop.error(loop.order, side)
        total = error * proportional
        if integral > 0.0:
            total = total + integrator(integral) * error
        if derivative > 0.0 and loop.order == 0:
            rate = loop.error(1, side)
            total = total + (low_pass(filter_time) * derivative if filter_time else derivative) * rate
        elif derivative > 0.0:
            # s / (tau s + 1) = (1 - 1 / (tau s + 1)) / tau: no measured acceleration is needed.
            total = total + (derivative / filter_time) * (error - low_pass(filter_time) * error)
        return loop.sense(side) * total


class PositionPI(_PID):
    """PI on the angle error."""

    type: Literal["pi"]
    proportional_nm_per_rad: float = Field(gt=0.0)
    """Gain on the angle error. Unit N m/rad."""
    integral_nm_per_rad_s: float = Field(ge=0.0)
    """Gain on its integral. Unit N m/(rad s)."""

    def gains(self) -> tuple[float, float, float, float]:
        """Gains without derivative."""
        return self.proportional_nm_per_rad, self.integral_nm_per_rad_s, 0.0, 0.0


class PositionPD(_PID):
    """PD on the angle error."""

    type: Literal["pd"]
    proportional_nm_per_rad: float = Field(gt=0.0)
    """Gain on the angle error. Unit N m/rad."""
    derivative_nm_s_per_rad: float = Field(ge=0.0)
    """Gain on its rate of change. Unit N m s/rad."""
    derivative_filter_time_s: float = Field(0.0, ge=0.0)
    """Time constant of the filter on the rate of change; 0 for none. Unit s."""

    def gains(self) -> tuple[float, float, float, float]:
        """Gains without integral."""
        return self.proportional_nm_per_rad, 0.0, self.derivative_nm_s_per_rad, self.derivative_filter_time_s


class PositionPID(PositionPD):
    """PID on the angle error."""

    type: Literal["pid"]  # type: ignore[assignment]
    integral_nm_per_rad_s: float = Field(ge=0.0)
    """Gain on the integral of the angle error. Unit N m/(rad s)."""

    def gains(self) -> tuple[float, float, float, float]:
        """All gains."""
        proportional, _, derivative, filter_time = super().gains()
        return proportional, self.integral_nm_per_rad_s, derivative, filter_time


class VelocityPI(_PID):
    """PI on the velocity error, with acceleration feedforward."""

    type: Literal["pi"]
    proportional_nm_s_per_rad: float = Field(gt=0.0)
    """Gain on the velocity error. Unit N m s/rad."""
    integral_nm_per_rad: float = Field(ge=0.0)
    """Gain on its integral. Unit N m/rad."""
    acceleration_feedforward_nm_s2_per_rad: float = Field(0.0, ge=0.0)
    """Torque per reference acceleration at the fed-back side (an inertia). Unit N m s^2/rad."""

    def gains(self) -> tuple[float, float, float, float]:
        """Gains without derivative."""
        return self.proportional_nm_s_per_rad, self.integral_nm_per_rad, 0.0, 0.0

    def system(self, loop: Loop) -> Any:
        """PI or PID plus feedforward."""
        side = loop.feedback
        forward = loop.sense(side) * self.acceleration_feedforward_nm_s2_per_rad
        return super().system(loop) + loop.reference(2, side) * forward


class VelocityPID(VelocityPI):
    """PID on the velocity error, with acceleration feedforward."""

    type: Literal["pid"]  # type: ignore[assignment]
    derivative_nm_s2_per_rad: float = Field(ge=0.0)
    """Gain on the rate of change of the velocity error. Unit N m s^2/rad."""
    derivative_filter_time_s: float = Field(gt=0.0)
    """Time constant of the filter that the derivative of a measured velocity needs. Unit s."""

    def gains(self) -> tuple[float, float, float, float]:
        """All gains."""
        proportional, integral, _, _ = super().gains()
        return proportional, integral, self.derivative_nm_s2_per_rad, self.derivative_filter_time_s


class Cascade(_Integrating):
    """Position loop (P) around a velocity loop (PI), with velocity and acceleration feedforward.

    The position loop closes on the command's ``feedback`` side, the velocity loop on ``velocity_feedback``.
    """

    type: Literal["cascade"]
    position_gain_per_s: float = Field(gt=0.0)
    """Reference velocity per angle error. Unit 1/s."""
    velocity_gain_nm_s_per_rad: float = Field(gt=0.0)
    """Torque per velocity error, at the side of the velocity loop. Unit N m s/rad."""
    velocity_integral_gain_nm_per_rad: float = Field(0.0, ge=0.0)
    """Torque per integral of the velocity error. Unit N m/rad."""
    velocity_feedforward: float = Field(1.0, ge=0.0)
    """Share of the trajectory's velocity that is fed forward to the velocity loop."""
    acceleration_feedforward_nm_s2_per_rad: float = Field(0.0, ge=0.0)
    """Torque per trajectory acceleration at the side of the velocity loop (an inertia). Unit N m s^2/rad."""
    velocity_feedback: Literal["motor", "output"] | None = None
    """Side of the velocity loop; the command's ``feedback`` side when left out."""

    def natural_tracking_time(self) -> float:
        """T_i of the velocity loop."""
        return self.velocity_gain_nm_s_per_rad / self.velocity_integral_gain_nm_per_rad

    def system(self, loop: Loop) -> Any:
        """Both loops in one."""
        inner = self.velocity_feedback or loop.feedback
        wanted = self.position_gain_per_s * loop.error(0, loop.feedback)
        wanted = wanted + self.velocity_feedforward * loop.reference(1, loop.feedback)
        error = loop.scale(loop.feedback, inner) * wanted - loop.measured(1, inner)
        total = self.velocity_gain_nm_s_per_rad * error
        if self.velocity_integral_gain_nm_per_rad > 0.0:
            total = total + integrator(self.velocity_integral_gain_nm_per_rad) * error
        total = total + self.acceleration_feedforward_nm_s2_per_rad * loop.reference(2, inner)
        return loop.sense(inner) * total


class TransferFunction(Controller):
    """A transfer function from the error (angle or velocity, as the command) to the motor torque."""

    type: Literal["transfer_function"]
    numerator: list[float] = Field(min_length=1)
    """Coefficients of the numerator, highest power of s first."""
    denominator: list[float] = Field(min_length=1)
    """Coefficients of the denominator, highest power of s first; at least as many as the numerator."""

    @model_validator(mode="after")
    def _proper(self) -> TransferFunction:
        def degree(coefficients: list[float]) -> int:
            used = [k for k, c in enumerate(coefficients) if c != 0.0]
            return len(coefficients) - 1 - used[0] if used else -1

        if degree(self.denominator) < 0:
            raise ValueError("the denominator is zero")
        if degree(self.numerator) > degree(self.denominator):
            raise ValueError(
                f"the numerator has degree {degree(self.numerator)}, the denominator "
                f"{degree(self.denominator)}: such a controller cannot be built; add poles"
            )
        return self

    def system(self, loop: Loop) -> Any:
        """The transfer function on the error, realised by ``control.tf2ss``."""
        import control as ct

        realised = ct.tf2ss(self.numerator, self.denominator)
        return loop.sense(loop.feedback) * (realised * loop.error(loop.order, loop.feedback))


class StateSpace(Controller):
    """A state-space controller x' = A x + B w, u = C x + D w.

    ``u`` is the motor torque itself: the sign of the ratio is the user's. References are seen at the
    ``feedback`` side; every other input at its own side. Units SI.
    """

    type: Literal["state_space"]
    inputs: list[InputName] = Field(min_length=1)
    """Names of the inputs w, in the order of the columns of B and D."""
    A: list[list[float]] = Field(default=[])
    """n by n; empty for a static controller."""
    B: list[list[float]] = Field(default=[])
    """n rows, one column per input."""
    C: list[float] = Field(default=[])
    """n numbers."""
    D: list[float] = Field(default=[])
    """One number per input; zero when left out."""
    anti_windup_gain: list[float] | None = None
    """L of x' = A x + B w + L (T - u), with T the limited torque: n numbers; none when left out."""

    @model_validator(mode="after")
    def _shapes(self) -> StateSpace:
        n, m = len(self.A), len(self.inputs)
        if len(set(self.inputs)) != m:
            raise ValueError(f"an input is named twice in {', '.join(self.inputs)}")
        found: dict[str, tuple[object, object, str]] = {
            "A": ([len(row) for row in self.A], [n] * n, f"{n} rows of {n} numbers"),
            "B": ([len(row) for row in self.B], [m] * n, f"{n} rows of {m} numbers, one per input"),
            "C": (len(self.C), n, f"{n} numbers, one per state"),
            "D": (len(self.D) or m, m, f"{m} numbers, one per input"),
            "anti_windup_gain": (len(self.anti_windup_gain or [0.0] * n), n, f"{n} numbers, one per state"),
        }
        for name, (given, needed, words) in found.items():
            if given != needed:
                raise ValueError(f"{name}: expected {words}")
        return self

    def system(self, loop: Loop) -> Any:
        """The system, its inputs wired to w."""
        import control as ct
        import numpy as np

        n, m = len(self.A), len(self.inputs)
        own = ct.ss(
            np.array(self.A).reshape(n, n),
            np.array(self.B).reshape(n, m),
            np.array(self.C).reshape(1, n),
            np.array(self.D or [0.0] * m).reshape(1, m),
        )
        scale = loop.scale(loop.at, loop.feedback)
        rows = [loop.row(**{name: scale if name.startswith("reference") else 1.0}).D for name in self.inputs]
        wires = np.vstack(rows)
        return own * ct.ss(np.zeros((0, 0)), np.zeros((0, wires.shape[1])), np.zeros((m, 0)), wires)

    def tracking_gain(self, C: Array, integrators: Any) -> Array:
        """The given gain."""
        import numpy as np

        return np.array(self.anti_windup_gain or [0.0] * len(C), dtype=float)
