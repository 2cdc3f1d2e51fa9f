"""How compiled code calls a kernel by its address. Imports numba: load lazily.

``call_element(address, *arguments)`` and its kin are usable inside numba functions only. Arrays are
handed over as pointers to their data, which must be contiguous float64 (int64 for ``integers``).
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_F = types.float64
_P = types.CPointer(types.float64)
_I = types.intp
_N = types.CPointer(types.int64)

#: The C signature of each contract of ``hdsim.kernel``.
SIGNATURES: dict[str, Any] = {
    "element": types.void(_P, _P, _I, _I, _P, _P),
    "twist": types.void(_F, _F, _P, _P),
    "mesh": types.void(_P, _P, _P, _P),
    "signal": types.void(_F, _F, _P, _P),
    "system": types.void(_F, _P, _N, _P, _P, _I, _P, _P, _P),
}


def _call(contract: str, address: Any, arguments: tuple[Any, ...]) -> Any:
    """Type and generate the indirect call of one contract."""
    kinds = SIGNATURES[contract].args
    typed = tuple(
        given if isinstance(kind, types.CPointer) else kind
        for kind, given in zip(kinds, arguments, strict=True)
    )

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        target = ir.FunctionType(ir.VoidType(), [context.get_value_type(kind) for kind in kinds])
        function = builder.inttoptr(values[0], target.as_pointer())
        handed = [
            context.make_array(given)(context, builder, value).data
            if isinstance(given, types.Array)
            else value
            for given, value in zip(signature.args[1:], values[1:], strict=True)
        ]
        builder.call(function, handed)
        return context.get_dummy_value()

    return types.void(types.intp, *typed), generate


@intrinsic
def call_element(_context, address, inputs, parameters, own, columns, outputs, jacobian):  # type: ignore[no-untyped-def]
    """Call an element kernel."""
    return _call("element", address, (inputs, parameters, own, columns, outputs, jacobian))


@intrinsic
def call_twist(_context, address, motor_angle, output_angle, parameters, error):  # type: ignore[no-untyped-def]
    """Call a twist kernel."""
    return _call("twist", address, (motor_angle, output_angle, parameters, error))


@intrinsic
def call_mesh(_context, address, angles, error, parameters, result):  # type: ignore[no-untyped-def]
    """Call a mesh kernel."""
    return _call("mesh", address, (angles, error, parameters, result))


@intrinsic
def call_signal(_context, address, time, inside, parameters, values):  # type: ignore[no-untyped-def]
    """Call a signal kernel."""
    return _call("signal", address, (time, inside, parameters, values))


@intrinsic
def call_system(_context, address, t, y, integers, reals, scratch, want, dy, jacobian, dfdt):  # type: ignore[no-untyped-def]
    """Call a system kernel."""
    return _call("system", address, (t, y, integers, reals, scratch, want, dy, jacobian, dfdt))
