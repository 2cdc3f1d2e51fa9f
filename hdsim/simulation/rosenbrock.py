"""The default method: RODAS in compiled blocks of steps, as a SciPy ``OdeSolver`` (imports SciPy and numba).

The method and its sources are in ``hdsim.simulation._rosenbrock``; when to use it in ``docs/integration.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DenseOutput, OdeSolver

from hdsim.simulation import _cover
from hdsim.simulation import _rosenbrock as compiled
from hdsim.simulation.failures import Guard
from hdsim.simulation.solvers import Integration, Statistics
from hdsim.system import System

Array = NDArray[np.float64]

_CAUSES = {
    compiled.STEP_TOO_SMALL: OdeSolver.TOO_SMALL_STEP,
    compiled.NOT_FINITE: "The right-hand side or its Jacobian is not finite.",
    _cover.NOT_FINITE_STATE: "The state is not finite.",
}


#: The statuses with which ``advance`` names a state.
_NAMES_SUSPECT = (compiled.STEP_TOO_SMALL, compiled.NOT_FINITE)
#: Blocks of steps that are taken between two looks at Ctrl-C: about a tenth of a second.
_BLOCKS = 500


@dataclass(frozen=True)
class Beside:
    """Models that differ a little from the one that is simulated; see ``hdsim.simulation._beside``.

    Attributes:
        reals: their numbers, shape (k, reals); a run changes those that say where it is.
        y0: their initial states, shape (k, n).
        integers: theirs, shape (k, integers).
        shared: whether each takes from the scratch what the model has computed there, shape (k,).
    """

    reals: Array
    y0: Array
    integers: NDArray[np.int64]
    shared: NDArray[np.bool_]


class _Block:
    """The arrays that the compiled loop works on, for one run of one system."""

    def __init__(
        self,
        system: System,
        t0: float,
        y0: Array,
        t_bound: float,
        rtol: float,
        atol: float | Array,
        first_step: float | None,
        max_step: float,
        steps: int,
        stops: Array | None = None,
    ) -> None:
        n = system.size
        self.steps = steps
        self.y = np.array(y0, dtype=np.float64)
        self.atol = np.empty(n)
        self.atol[:] = atol
        if not (rtol >= 0.0 and min(self.atol.tolist(), default=1.0) >= 0.0):
            raise ValueError("`rtol` and `atol` must not be negative.")
        self.control = np.array([t0, t_bound, first_step or 0.0, max_step, rtol, 0.0, 0.0])
        self.counts = np.zeros(compiled.COUNTS_SIZE + n, dtype=np.int64)
        self.counts[compiled.SIZE] = n
        self.counts[compiled.QUADRATURES] = system.quadratures
        self._kernel = (
            system.kernel.address,
            system.integers,
            system.reals,
            np.zeros(max(1, system.scratch_size)),
            np.zeros(0) if stops is None else np.ascontiguousarray(stops, dtype=np.float64),
        )
        self._work = np.empty(compiled.work_size(n, system.quadratures))
        self.renew()

    def renew(self) -> None:
        """Take new arrays for the steps; the old ones now belong to somebody else."""
        n, k = len(self.y), self.steps
        self.record = np.empty(k + 1), np.empty((k + 1, n)), np.empty((k, 2, n))

    def advance(self) -> int:
        """Take up to ``steps`` steps; see ``_rosenbrock.advance``."""
        return int(
            compiled.advance(
                *self._kernel, self.y, self.atol, self.control, self.counts, self._work, *self.record
            )
        )

    def cover(
        self,
        cuts: Array,
        inside_at: int,
        guard: Guard | None,
        t_eval: Array,
        others: Beside,
        most_steps: float,
    ) -> tuple[int, Array, int, Array]:
        """Integrate through all spans, or until so many steps are taken; see ``_cover.cover``.

        Returns status, samples (m, n), their number, and differences of the others' samples (k, m, n).
        """
        out = np.full((len(t_eval), len(self.y)), np.nan)
        near = np.ascontiguousarray((others.y0 - self.y).T)
        beside = np.full((len(others.y0), *out.shape), np.nan)
        slopes, sizes = np.zeros_like(near), np.abs(near)
        progress = np.zeros(2, dtype=np.int64)
        status = compiled.RUNNING
        tried = slice(compiled.ACCEPTED, compiled.REJECTED + 1)
        while status == compiled.RUNNING and self.counts[tried].sum() <= most_steps:
            status = _cover.cover(
                *self._kernel,
                self.y,
                self.atol,
                self.control,
                self.counts,
                self._work,
                *self.record,
                cuts,
                inside_at,
                -1 if guard is None else guard.index,
                np.inf if guard is None else guard.limit,
                t_eval,
                out,
                progress,
                _BLOCKS,
                others.reals,
                others.integers,
                others.shared,
                near,
                slopes,
                sizes,
                beside,
            )
        return int(status), out, int(progress[_cover.SAMPLED]), beside


class Rodas4(OdeSolver):  # type: ignore[misc]
    """RODAS (Hairer & Wanner 1996, IV.7): L-stable Rosenbrock method of order 4(3).

    Use it as ``solve_ivp(system.rhs, (t0, t1), y0, method=Rodas4, system=system)``. One call of ``step``
    takes up to ``steps_per_call`` accepted steps; ``t_old`` and ``t`` are then the ends of that block, and
    ``dense_output`` spans it. ``solve_ivp`` looks for events, and without ``t_eval`` returns points, at the
    ends of blocks only: with events set ``steps_per_call=1``, which is stock behaviour.

    A failing step leaves what the block did before it: that is delivered first, the next ``step`` fails.

    Args:
        fun: ignored but for the interface; the kernel of ``system`` is called instead.
        t0: start.
        y0: initial state, shape (n,).
        t_bound: end; may lie before the start.
        vectorized: ignored.
        system: the compiled system.
        rtol: relative tolerance.
        atol: absolute tolerance, a number or shape (n,).
        first_step: size of the first step; chosen when None. Longer than the span is allowed, and remembered
            in ``next_step``: spans between discontinuities can be shorter than a step.
        max_step: largest step.
        steps_per_call: accepted steps in one block.
        stops: increasing times at which a step ends, shape (s,): where a higher derivative of the right-hand
            side jumps, a step across it loses its order, and is mostly rejected.

    Attributes:
        steps: number of accepted steps.
        rejected: number of rejected steps.
        suspect: after a failure, index of the state that caused it; else None.

    Raises:
        ValueError: an argument is out of its range.
    """

    t: float
    y: Array
    steps = 0
    rejected = 0
    suspect: int | None = None

    def __init__(
        self,
        fun: Any,
        t0: float,
        y0: Array,
        t_bound: float,
        vectorized: bool = False,
        *,
        system: System,
        rtol: float = 1e-3,
        atol: float | Array = 1e-6,
        first_step: float | None = None,
        max_step: float = np.inf,
        steps_per_call: int = 64,
        stops: Array | None = None,
    ) -> None:
        super().__init__(fun, t0, y0, t_bound, vectorized)
        if self.n != system.size:
            raise ValueError(f"`y0` has {self.n} states, the system {system.size}.")
        if not max_step > 0.0:
            raise ValueError("`max_step` must be positive.")
        if first_step is not None and not first_step > 0.0:
            raise ValueError("`first_step` must be positive.")
        if steps_per_call < 1:
            raise ValueError("`steps_per_call` must be at least 1.")
        self._block = _Block(
            system, t0, self.y, t_bound, rtol, atol, first_step, max_step, steps_per_call, stops
        )
        self._failure: int | None = None
        self._handed_over = False

    @property
    def next_step(self) -> float:
        """Size of the step that would be tried next, not cut by ``t_bound``; 0 before the first."""
        return float(self._block.control[compiled.STEP])

    def _step_impl(self) -> tuple[bool, str | None]:
        """Take a block of steps."""
        block = self._block
        done = 0
        if self._failure is None:
            if self._handed_over:
                block.renew()
                self._handed_over = False
            status = block.advance()
            done, self.nfev, self.njev, self.nlu, self.steps, self.rejected = block.counts[
                compiled.DONE : compiled.REJECTED + 1
            ].tolist()
            if status < 0:
                self._failure = status
        if done == 0 and self._failure is not None:
            suspect = int(block.counts[compiled.SUSPECT])
            self.suspect = suspect if suspect >= 0 else None
            return False, _CAUSES[self._failure]
        self.t = float(block.control[compiled.T])
        self.y = block.y.copy()
        self._done = done
        return True, None

    def _dense_output_impl(self) -> BlockDenseOutput:
        """Continuous extension over the last block."""
        self._handed_over = True
        return BlockDenseOutput(self.t_old, self.t, self._block.record, self._done)


class BlockDenseOutput(DenseOutput):  # type: ignore[misc]
    """Continuous extension of RODAS, of order 3, over the steps of one block."""

    def __init__(self, t_old: float, t: float, record: tuple[Array, Array, Array], count: int) -> None:
        super().__init__(t_old, t)
        self._record, self._count = record, count

    def _call_impl(self, t: Array) -> Array:
        """Values at t: shape (n,) for a number, (n, m) for shape (m,)."""
        points = np.ascontiguousarray(t, dtype=np.float64).reshape(-1)
        out = np.empty((self._record[1].shape[1], len(points)))
        compiled.interpolate(*self._record, self._count, points, out)
        return out[:, 0] if np.ndim(t) == 0 else out


def rodas4_through(
    system: System,
    cuts: Array,
    y0: Array,
    t_eval: Array,
    *,
    rtol: float,
    atol: float | Array,
    stops: Array | None = None,
    inside_at: int = -1,
    guard: Guard | None = None,
    first_step: float | None = None,
    max_step: float = np.inf,
    others: Beside | None = None,
    most_steps: float = np.inf,
) -> Integration:
    """Integrate forward through smooth spans in one compiled loop, without SciPy's.

    The steps are those of ``Rodas4`` called span after span, so that the result is the same to rounding;
    what SciPy's loop costs is saved, which counts where a run is short and is asked for a thousand times.

    Args:
        system: the compiled system.
        cuts: shape (spans + 1,), s, increasing: start, what the right-hand side jumps at, end.
        y0: initial state, shape (n,).
        t_eval: increasing times to sample at, shape (m,), within the cuts.
        rtol: relative tolerance.
        atol: absolute tolerance, a number or shape (n,).
        stops: increasing times at which a step ends, shape (s,); see ``Rodas4``.
        inside_at: place in the system's reals of a time inside the current span; -1 when it has none.
        guard: gives the run up.
        first_step: size of the first step; chosen when None.
        max_step: largest step.
        others: models beside this one, alike in all but numbers and without quadratures.
        most_steps: the run is given up at the end of the blocks in which it has tried more.

    Returns:
        Samples (n, m) up to where it came, and why it stopped. ``message`` has no hint at the cause.
    """
    t_eval = np.ascontiguousarray(t_eval, dtype=np.float64)
    if system.size == 0:
        nothing = np.zeros((0 if others is None else len(others.y0), len(t_eval), 0))
        empty = np.empty((0, len(t_eval)))
        return Integration(t_eval, empty, float(cuts[-1]), y0, None, True, "", beside=nothing)
    if others is None:
        lists = np.zeros((0, len(system.integers)), dtype=np.int64)
        reals, none = np.zeros((0, len(system.reals))), np.zeros((0, system.size))
        others = Beside(reals, none, lists, np.zeros(0, dtype=np.bool_))
    block = _Block(system, float(cuts[0]), y0, float(cuts[1]), rtol, atol, first_step, max_step, 64, stops)
    status, samples, count, beside = block.cover(cuts, inside_at, guard, t_eval, others, most_steps)
    t = float(block.control[compiled.T])
    error = guard.error() if status == _cover.RUNAWAY and guard is not None else None
    cause = f"RunawayError: {error}." if error is not None else _CAUSES.get(status, "")
    if status == compiled.RUNNING:
        cause = f"More than {most_steps:.6g} steps."
    suspect = int(block.counts[compiled.SUSPECT]) if status in _NAMES_SUSPECT else -1
    return Integration(
        t=t_eval[:count],
        y=samples[:count].T,
        t_end=t,
        y_end=block.y,
        next_step=float(block.control[compiled.STEP]),
        success=status == compiled.FINISHED,
        message=f"{cause} Stopped at t = {t:.9g} s." if cause else "",
        statistics=Statistics(*block.counts[compiled.NFEV : compiled.REJECTED + 1].tolist()),
        suspect=suspect if suspect >= 0 else None,
        exception=error,
        beside=beside,
    )
