"""Calls of an effect's kernels without a drive, compiled (imports numba: load lazily)."""

from hdsim._abi import call_element, call_twist
from hdsim._compile import compiled


@compiled
def elements(addresses, offsets, owns, numbers, columns, inputs, outputs, jacobian):  # type: ignore[no-untyped-def]
    """All elements in turn, each adding."""
    for i in range(len(addresses)):
        call_element(addresses[i], inputs, numbers[offsets[i] :], owns[i], columns, outputs, jacobian)


@compiled
def twists(addresses, offsets, numbers, motor_angle, output_angle, error):  # type: ignore[no-untyped-def]
    """All contributions to the mesh twist in turn, each adding."""
    for i in range(len(addresses)):
        call_twist(addresses[i], motor_angle, output_angle, numbers[offsets[i] :], error)
