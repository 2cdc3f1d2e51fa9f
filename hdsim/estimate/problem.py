"""What a least-squares fit asks of anybody's problem: numbers with priors and bounds, and a residual."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

from numpy.typing import NDArray

from hdsim.estimate.records import Array


class Problem(Protocol):
    """Numbers x, shape (p,), and the residual that they leave: measured less predicted, divided by its scale.

    Attributes:
        names: of the numbers.
        start: where a fit begins, shape (p,); the centre of the priors too.
        priors: standard deviations that were believed before the data, shape (p,); ``inf`` for none.
        bounds: lower and upper bounds, shape (p,) each.
        blocks: number of the block that each row of the residual belongs to, shape (rows,). Rows of one block
            may be correlated, blocks are not: stretches of time, say, or each row its own for white noise.
    """

    @property
    def names(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def start(self) -> Array: ...  # noqa: D102
    @property
    def priors(self) -> Array: ...  # noqa: D102
    @property
    def bounds(self) -> tuple[Array, Array]: ...  # noqa: D102
    @property
    def blocks(self) -> NDArray[Any]: ...  # noqa: D102

    def residual(self, x: Array) -> Array:
        """Shape (rows,).

        Raises:
            ArithmeticError: it cannot be computed there; a fit then steps back.
        """


@runtime_checkable
class Differentiable(Problem, Protocol):
    """A problem that knows its derivatives; of another they are finite differences."""

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residual, shape (rows, p)."""


@runtime_checkable
class Simulated(Problem, Protocol):
    """A problem whose residual is dear and has a solver's noise: it chooses its differences itself."""

    def steps(self, x: Array) -> Array:
        """Largest steps in which it is linear, shape (p,)."""

    def changes(self, pairs: Sequence[tuple[Array, Array]]) -> list[Array | None]:
        """Residual at the first place of each pair less the one at the second; None where one is missing."""

    def sensitivities(
        self, x: Array, first: int = 0, like: Array | None = None, *, tangents: bool = False
    ) -> Array:
        """Derivatives of the residual, their sign turned, to the numbers from ``first`` on.

        With ``tangents`` they are for a step of a fit, and may be cheaper than differences that are large
        enough to be heard.
        """
