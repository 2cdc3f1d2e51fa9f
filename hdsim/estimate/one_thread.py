"""Linear algebra on one thread: the numbers of a fit must not depend on cores, nor on what ran before it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Hold every BLAS to one thread while this lasts.

    A product that is split over threads is summed in another order, and a fit carries the last digit on into
    directions that the data hardly tell. The matrices are narrow besides: threads inside each product cost
    more than they give, and those outside it already use the cores.
    """
    # SciPy brings a BLAS of its own, and a limit reaches only what is loaded: imported within, the first fit
    # of a process would run under other threads than all later ones.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield
