"""Kernels: small Python functions, compiled on first use, that every solver calls by their address.

A model is a list of kernels. Each is compiled once per machine (numba keeps it on disk) and called
through its address, so any combination of effects, loads and controllers runs without compiling
anything new. A kernel uses only arithmetic and the ``math`` module; importing a kernel's file
therefore costs nothing, and commands that simulate nothing never import numba.

The contracts are the four signatures below. ``docs/extending.md`` shows them at work.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

# Inputs of an element: columns of ``inputs`` and of its Jacobian. SI units.
MOTOR_ANGLE = 0  #: rad, motor and wave generator
MOTOR_VELOCITY = 1  #: rad/s
RING_ANGLE = 2  #: rad, flexspline toothed ring
RING_VELOCITY = 3  #: rad/s
OUTPUT_ANGLE = 4  #: rad, output and load
OUTPUT_VELOCITY = 5  #: rad/s
TRANSMITTED_TORQUE = 6  #: N m, of the drive on the output: elastic and of hysteresis, no damping
TWIST = 7  #: rad, twist of the torsion spring
TWIST_RATE = 8  #: rad/s
MESH_TWIST = 9  #: rad, twist of the mesh, before the gap
MESH_TWIST_RATE = 10  #: rad/s
TIME = 11  #: s

# Outputs of an element: rows of ``outputs`` and of its Jacobian.
MOTOR_TORQUE = 0  #: N m on the motor
RING_TORQUE = 1  #: N m on the ring
OUTPUT_TORQUE = 2  #: N m on the output
TWIST_TORQUE = 3  #: N m conjugate to the twist (a spring gives -k * twist)
MESH_TORQUE = 4  #: N m conjugate to the mesh twist
DISSIPATED = 5  #: W turned into heat, never negative
SUPPLIED = 6  #: W supplied from outside (motor)
DELIVERED = 7  #: W delivered to the outside (load torque)
STORED = 8  #: J stored in the element; no derivative is read
INPUT_FRICTION = 9  #: N m, friction on the motor shaft, for the log; no derivative is read
COMMANDED_TORQUE = 10  #: N m, torque of the motor's windings, for the log; no derivative is read
LOAD_TORQUE = 11  #: N m, known external torque on the output, for the log; no derivative is read

#: First index of the elements' own states, in the inputs and in the outputs (there: their rates).
OWN = 12

#: Values that a signal contributes to the inputs: itself and its first three time derivatives.
SIGNAL_VALUES = 4


class Kernel:
    """A function with one of the contracts of this module, compiled when its address is first asked for."""

    def __init__(self, function: Callable[..., None], contract: str) -> None:
        self.function = function
        self.contract = contract
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__

    @cached_property
    def _compiled(self) -> Any:
        from hdsim._abi import SIGNATURES
        from hdsim._compile import compiled_address

        return compiled_address(self.function, SIGNATURES[self.contract])

    @property
    def address(self) -> int:
        """Address of the compiled function."""
        return int(self._compiled.address)

    def __repr__(self) -> str:
        return f"<{self.contract} kernel {self.function.__module__}.{self.__name__}>"


def element(function: Callable[..., None]) -> Kernel:
    """Declare ``f(inputs, parameters, own, columns, outputs, jacobian)``: anything that makes a torque.

    Args of the kernel:
        inputs: pointer to the inputs, indexed by the constants above; own states from ``inputs[own]``,
            signals at the columns that the builder handed out.
        parameters: pointer to the element's own numbers.
        own: index of its first own state, in ``inputs`` and ``outputs`` alike.
        columns: number of columns of the Jacobian.
        outputs: add to ``outputs[row]``.
        jacobian: add d outputs[row] / d inputs[column] to ``jacobian[row * columns + column]``.

    Everything is *added*, nothing is set. The derivatives must be exact; the tests compare every
    element's with finite differences.
    """
    return Kernel(function, "element")


def twist(function: Callable[..., None]) -> Kernel:
    """Declare ``f(motor_angle, output_angle, parameters, error)``: a contribution to the mesh twist.

    ``error`` holds six numbers to add to: e, de/dm, de/do, d2e/dm2, d2e/dm do, d2e/do2 (m motor, o output
    angle; rad). The builder turns them into the twist *and* its reaction torques.
    """
    return Kernel(function, "twist")


def mesh(function: Callable[..., None]) -> Kernel:
    """Declare ``f(angles, error, parameters, result)``: the conservative core, see ``hdsim.drive.mesh``."""
    return Kernel(function, "mesh")


def signal(function: Callable[..., None]) -> Kernel:
    """Declare ``f(time, inside, parameters, values)``: a function of time and its three derivatives.

    ``inside`` is a time strictly inside the current smooth span: choose the piece of a piecewise
    function by ``inside``, evaluate it at ``time``. Sets ``values[0:4]``.
    """
    return Kernel(function, "signal")


def system(function: Callable[..., None]) -> Kernel:
    """Declare ``f(t, y, integers, reals, scratch, want_jacobian, dy, jacobian, dfdt)``: an ODE y' = f(t, y).

    ``jacobian`` is n by n, row-major, set only when ``want_jacobian`` is not 0, ``dfdt`` likewise.
    The last ``quadratures`` states (see ``hdsim.system``) may not appear in any right-hand side.
    """
    return Kernel(function, "system")
