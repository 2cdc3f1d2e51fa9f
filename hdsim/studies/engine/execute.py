"""Batches of runs on an executor: in this process, on a pool of processes, or on a Dask cluster.

Everything goes through ``concurrent.futures.Executor``; which one it is makes no difference to the results.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager

from hdsim.errors import HdsimError, InputError
from hdsim.simulation.ensemble import InProcess, as_completed
from hdsim.studies.engine.worker import Batch, Job, Recipe, Row, run_batch, warm_start

#: Most runs in one task: enough to hide the cost of sending it, few enough to lose little by a kill.
LARGEST_BATCH = 50
#: One thread a process: the matrices are small, and the processes already fill the machine.
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@contextmanager
def executor(workers: int = 1, scheduler: str | None = None) -> Iterator[tuple[Executor, int]]:
    """An executor and the number of tasks that it works on at the same time.

    Args:
        workers: processes on this machine; 1 stays in this process.
        scheduler: address of a Dask scheduler, used instead.

    Raises:
        InputError: Dask is not installed or its scheduler does not answer.
    """
    if scheduler is not None:
        with _dask(scheduler) as found:
            yield found
    elif workers == 1:
        yield InProcess(), 1
    else:
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        # Spawned, not forked: a fork copies the threads' locks of numerical libraries in any state.
        with _environment(dict.fromkeys(_ONE_THREAD, "1")):
            pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=warm_start)
            try:
                yield pool, workers
            finally:
                pool.shutdown(cancel_futures=True)


@contextmanager
def _dask(address: str) -> Iterator[tuple[Executor, int]]:
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs Dask: pip install 'hdsim[cluster]'") from None
    try:
        client = Client(address, timeout="10s")
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"--scheduler: no Dask scheduler answers at {address} ({error})") from None
    try:
        threads = sum(client.ncores().values())
        if not threads:
            raise InputError(f"--scheduler: the Dask scheduler at {address} has no workers")
        with client.get_executor(pure=False) as found:
            yield found, threads
    finally:
        client.close()


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set variables that child processes inherit, unless the user has set them."""
    added = {name: value for name, value in values.items() if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


def batches(
    recipe: Recipe, metrics: Sequence[str], jobs: Sequence[Job], width: int, logs: str | None = None
) -> list[Batch]:
    """Cut runs into batches: at most fifty, and enough of them that every worker has some to the end."""
    size = max(1, min(LARGEST_BATCH, len(jobs) // (8 * width)))
    return [Batch(recipe, tuple(metrics), tuple(jobs[k : k + size]), logs) for k in range(0, len(jobs), size)]


def execute(
    waiting: Sequence[Batch], pool: Executor, width: int, on_rows: Callable[[list[Row]], object]
) -> None:
    """Work through batches; every batch's rows are handed on as soon as they are there, in any order.

    Args:
        waiting: the batches.
        pool: where they run.
        width: how many run at the same time; twice as many are handed out.
        on_rows: gets the rows of a finished batch.

    Raises:
        HdsimError: a worker process died.
    """
    from concurrent.futures.process import BrokenProcessPool

    try:
        for _, rows in as_completed(run_batch, waiting, pool, width):
            on_rows(rows)
    except BrokenProcessPool as error:
        raise HdsimError(
            "a worker process died (out of memory, or killed); what was done is kept, start the study again "
            "to go on, with fewer --workers if memory was short"
        ) from error
