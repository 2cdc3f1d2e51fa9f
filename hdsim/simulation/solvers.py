"""Every run of hdsim goes through here, and through ``scipy.integrate.solve_ivp``; fits: see ``sample``.

The methods are SciPy's own and ``hdsim.simulation.rosenbrock.Rodas4``. Whatever stops a run (a step that
gets too small, a number that is not finite, Ctrl-C, an error in the caller's ``on_step``) is reported in
the result next to all that was computed before.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Method:
    """A way to integrate.

    Args:
        module: where its ``OdeSolver`` class lives; imported on first use.
        class_name: name of that class.
        jacobian: whether it takes the Jacobian as the option ``jac``.
        one_step: whether each step starts afresh, so that the last step size of a span suits the next one.
        compiled: whether it calls the system's kernel itself, by the option ``system``.
        summary: one line for the user.
    """

    module: str
    class_name: str
    jacobian: bool
    one_step: bool
    compiled: bool
    summary: str


def _stock(name: str, jacobian: bool, one_step: bool, summary: str) -> Method:
    """One of SciPy's own methods."""
    return Method("scipy.integrate", name, jacobian, one_step, compiled=False, summary=summary)


#: The methods by name; the first is the default.
METHODS: dict[str, Method] = {
    "rodas4": Method(
        "hdsim.simulation.rosenbrock",
        "Rodas4",
        jacobian=False,
        one_step=True,
        compiled=True,
        summary="Rosenbrock, order 4, L-stable, compiled; the default",
    ),
    "RK45": _stock("RK45", False, True, "explicit Runge-Kutta of order 5; not for stiff models"),
    "DOP853": _stock(
        "DOP853", False, True, "explicit Runge-Kutta of order 8; smooth, not stiff, tight tolerances"
    ),
    "Radau": _stock("Radau", True, True, "implicit Runge-Kutta of order 5; stiff"),
    "BDF": _stock("BDF", True, False, "multistep of orders 1 to 5; stiff, few accurate digits"),
    "LSODA": _stock("LSODA", True, False, "Adams and BDF with switching, from ODEPACK"),
}

#: A stock method that sees this many non-finite right-hand sides in a row is stopped: some never give up.
_NOT_FINITE_IN_A_ROW = 500


@dataclass
class Statistics:
    """Work done: evaluations of the right-hand side and the Jacobian, LU decompositions, steps.

    ``steps`` are the accepted ones; ``rejected`` is known for ``rodas4`` only (else 0).
    """

    nfev: int = 0
    njev: int = 0
    nlu: int = 0
    steps: int = 0
    rejected: int = 0

    def add(self, other: Statistics) -> None:
        """Add the work of another span."""
        self.nfev += other.nfev
        self.njev += other.njev
        self.nlu += other.nlu
        self.steps += other.steps
        self.rejected += other.rejected


@dataclass
class Integration:
    """What ``integrate`` found.

    Args:
        t: times of the samples, shape (m,).
        y: samples, shape (n, m).
        t_end: the time that was reached.
        y_end: state at ``t_end``, shape (n,).
        next_step: size of the step to start the next span with; None for a method that had better choose.
        success: whether ``t_end`` is the end that was asked for.
        message: why not; ends with the time. Empty on success.
        statistics: work done.
        suspect: index of the state that made the step fail, when known.
        exception: what ``on_step`` or the method raised (``KeyboardInterrupt`` included), for the caller to
            raise again after it has saved the result.
    """

    t: Array
    y: Array
    t_end: float
    y_end: Array
    next_step: float | None
    success: bool
    message: str
    statistics: Statistics = field(default_factory=Statistics)
    suspect: int | None = None
    exception: BaseException | None = None
    beside: Array | None = None


class _Watch:
    """What a watched solver tells its caller, who never gets hold of it through ``solve_ivp``."""

    def __init__(self, t: float, y: Array, on_step: Callable[[float, Array], object] | None) -> None:
        self.t, self.y = t, y
        self.on_step = on_step
        self.calls = 0
        self.next_step = 0.0
        self.solver: Any = None
        self.exception: BaseException | None = None


class _NotFiniteError(ArithmeticError):
    """The right-hand side stays non-finite."""


@cache
def _watched(method: str) -> type:
    """The method's ``OdeSolver``, in a subclass that reports its steps and never raises out of ``step``."""
    from importlib import import_module

    chosen = METHODS[method]
    base: Any = getattr(import_module(chosen.module), chosen.class_name)

    class Watched(base):  # type: ignore[misc]
        def __init__(self, *arguments: Any, watch: _Watch, **options: Any) -> None:
            super().__init__(*arguments, **options)
            self._watch = watch
            watch.solver = self

        def step(self) -> str | None:
            """Take a step; say it to the watch."""
            watch = self._watch
            if watch.exception is not None:  # raised by on_step after the last step, which was good
                self.status = "failed"
                return _describe(watch.exception)
            planned = max(_planned_step(self), watch.next_step)
            try:
                message: str | None = super().step()
            except (ArithmeticError, ValueError, np.linalg.LinAlgError, KeyboardInterrupt) as error:
                watch.exception = error
                self.status = "failed"
                return _describe(error)
            if self.status == "failed":
                return message
            if not math.isfinite(self.y @ self.y) and not np.isfinite(self.y).all():
                self.status = "failed"
                return "The state is not finite."
            watch.t, watch.y = float(self.t), self.y
            watch.calls += 1
            watch.next_step = _planned_step(self)
            if self.status == "finished" and not chosen.compiled:
                # A stock method cuts its last step at the bound and then forgets the uncut one.
                watch.next_step = max(watch.next_step, planned)
            if watch.on_step is not None:
                try:
                    watch.on_step(watch.t, watch.y)
                except (Exception, KeyboardInterrupt) as error:
                    watch.exception = error
            return message

    Watched.__name__ = Watched.__qualname__ = f"Watched{chosen.class_name}"
    return Watched


def _planned_step(solver: Any) -> float:
    """Size of the step that a solver plans; 0 when it does not say so."""
    step: float = getattr(solver, "next_step", 0.0) or getattr(solver, "h_abs", 0.0)
    return float(step) if 0.0 < step < math.inf else 0.0


def _describe(error: BaseException) -> str:
    """One sentence for what stopped a run."""
    if isinstance(error, KeyboardInterrupt):
        return "Interrupted."
    if isinstance(error, _NotFiniteError):
        return str(error)
    return f"{type(error).__name__}: {error}."


def _guarded(system: System) -> Callable[[float, Array], Array]:
    """The right-hand side, raising when it stays non-finite: some stock methods would try for ever."""
    rhs = system.rhs
    bad = 0

    def guarded(t: float, y: Array) -> Array:
        nonlocal bad
        dy = rhs(t, y)
        if math.isfinite(dy @ dy):
            bad = 0
        else:
            bad += 1
            if bad > _NOT_FINITE_IN_A_ROW:
                raise _NotFiniteError("The right-hand side is not finite.")
        return dy

    return guarded


def integrate(
    system: System,
    t0: float,
    t1: float,
    y0: Array,
    *,
    method: str = "rodas4",
    rtol: float = 1e-6,
    atol: float | Array | None = None,
    t_eval: Array | None = None,
    first_step: float | None = None,
    max_step: float = math.inf,
    stops: Array | None = None,
    on_step: Callable[[float, Array], object] | None = None,
) -> Integration:
    """Integrate a system over one smooth span with ``scipy.integrate.solve_ivp``.

    Args:
        system: the compiled system.
        t0: start, s.
        t1: end, s; may lie before the start.
        y0: initial state, shape (n,).
        method: a name in ``METHODS``.
        rtol: relative tolerance.
        atol: absolute tolerance, a number or shape (n,); ``rtol * system.scale`` when None.
        t_eval: times to sample at, shape (m,), sorted in the direction of integration and within the span;
            None samples where the method comes back to Python (``rodas4``: every block of steps).
        first_step: size of the first step, cut to the span; chosen when None.
        max_step: largest step, s.
        stops: increasing times at which steps had better end, s, shape (k,): corners of a higher derivative
            of the right-hand side (``rodas4``; the stock methods step across them).
        on_step: called as ``on_step(t, y)`` after each step of the method (``rodas4``: block of steps). If it
            raises, the run stops there.

    Returns:
        The samples, the last good state and why it stopped.

    Raises:
        InputError: no such method, no absolute tolerance, or an initial state of the wrong shape.
    """
    from scipy.integrate import solve_ivp

    if method not in METHODS:
        raise InputError(f"no integration method {method!r}; there are: {', '.join(METHODS)}")
    y0 = np.array(y0, dtype=np.float64)
    if y0.shape != (system.size,):
        raise InputError(f"initial state of shape {y0.shape}; the system has {system.size} states")
    if atol is None:
        if len(system.scale) != system.size:
            raise InputError("this system has no scale of its states: give an absolute tolerance")
        atol = rtol * system.scale

    chosen = METHODS[method]
    watch = _Watch(float(t0), y0, on_step)
    options: dict[str, Any] = {"rtol": rtol, "atol": atol, "max_step": max_step, "watch": watch}
    if first_step is not None and t0 != t1:
        watch.next_step = first_step  # remembered where the span is shorter
        options["first_step"] = first_step if chosen.compiled else min(first_step, abs(t1 - t0))
    fun: Callable[[float, Array], Array] = system.rhs
    if chosen.compiled:
        options |= {"system": system, "stops": stops}
    else:
        fun = _guarded(system)
        if chosen.jacobian:
            options["jac"] = system.jacobian

    empty = np.empty((system.size, 0))
    bad = None if math.isfinite(y0 @ y0) else _first_not_finite(y0)
    if bad is not None:
        return _failed(watch, empty, "The initial state is not finite.", bad)
    if not chosen.compiled:
        bad = _first_not_finite(system.rhs(t0, y0))
        if bad is not None:
            return _failed(watch, empty, "The right-hand side is not finite.", bad)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            found = solve_ivp(fun, (t0, t1), y0, method=_watched(method), t_eval=t_eval, **options)
    else:
        found = solve_ivp(fun, (t0, t1), y0, method=_watched(method), t_eval=t_eval, **options)

    solver = watch.solver
    success = bool(found.success) and watch.exception is None
    message = ""
    if not success:
        reason = found.message if watch.exception is None else _describe(watch.exception)
        message = f"{reason} Stopped at t = {watch.t:.9g} s."
    return Integration(
        t=found.t if len(found.t) else np.empty(0),
        y=found.y if len(found.t) else empty,
        t_end=watch.t,
        y_end=watch.y,
        next_step=watch.next_step if chosen.one_step and watch.next_step > 0.0 else None,
        success=success,
        message=message,
        statistics=Statistics(
            found.nfev,
            int(found.njev),
            int(found.nlu),
            getattr(solver, "steps", watch.calls),
            getattr(solver, "rejected", 0),
        ),
        suspect=getattr(solver, "suspect", None),
        exception=watch.exception,
    )


def _first_not_finite(values: Array) -> int | None:
    """Index of the first number that is not finite."""
    bad = np.flatnonzero(~np.isfinite(values))
    return int(bad[0]) if len(bad) else None


def _failed(watch: _Watch, empty: Array, reason: str, suspect: int) -> Integration:
    """A run that could not take one step."""
    return Integration(
        t=np.empty(0),
        y=empty,
        t_end=watch.t,
        y_end=watch.y,
        next_step=None,
        success=False,
        message=f"{reason} Stopped at t = {watch.t:.9g} s.",
        suspect=suspect,
    )
