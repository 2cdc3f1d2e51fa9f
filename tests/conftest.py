"""How the tests share the processors: one thread for each process beside others, the long ones first."""

from __future__ import annotations

import os
from itertools import pairwise

import pytest

WORKERS = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
if WORKERS > 1:
    # The processes beside each other take the cores already. Threads of OpenMP that wait for one another on
    # taken cores spin: scikit-learn's trees took eight times the processor time.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let every process begin with slow tests: what is left to be shared out at the end is short.

    Work stealing gives each process an equal part of the list, in its order, and takes from the end of the
    longest part; the halves of slow and of quick tests are dealt out as whole stretches, which keeps most
    files, and what their tests share, together.
    """
    if WORKERS == 1:
        return
    slow = [item for item in items if item.get_closest_marker("slow")]
    quick = [item for item in items if not item.get_closest_marker("slow")]
    counts = [[len(part) * k // WORKERS for k in range(WORKERS + 1)] for part in (items, slow)]
    items[:] = []
    for (begin, end), (first, last) in zip(*map(pairwise, counts), strict=True):
        own = slow[first:last]
        others = max(0, end - begin - len(own))
        items += own + quick[:others]
        del quick[:others]
    items += quick
