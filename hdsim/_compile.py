"""Compilation by numba with a cache on disk that notices a change in any compiled file (imports numba).

numba's own cache watches only the file of the function itself: change a function that is called from
another file, and the caller goes on running the old code. Here the stamp of a cache entry covers every file
whose code can end up in compiled functions: the package's ``_*.py`` files and ``kernel.py``.

The cache is beside the code (``__pycache__``); where that is read-only, numba keeps it in the user's cache.
Where there is none (a service without a home), it is in a folder of this user's among the temporary ones.
"""

from __future__ import annotations

import os
import stat
import tempfile
import warnings
from collections.abc import Callable
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

from numba import config, njit
from numba.core import event
from numba.core.ccallback import CFunc

from hdsim.console import waiting

#: What a user reads while the first run on a machine compiles; about 30 s on one core at 3 GHz, measured.
COMPILING = "compiling the model, once on this machine: about half a minute"


class _Announcer(event.Listener):  # type: ignore[misc]
    """Tells a terminal that something is compiled; compilations nest, the outermost one is told of."""

    def __init__(self) -> None:
        self._inside: list[ExitStack] = []

    def on_start(self, event: Any) -> None:
        """Begin to tell."""
        told = ExitStack()
        if not self._inside:
            told.enter_context(waiting(COMPILING))
        self._inside.append(told)

    def on_end(self, event: Any) -> None:
        """Stop telling."""
        self._inside.pop().close()


event.register("numba:compile", _Announcer())


class _Callback(CFunc):
    """A C callback whose compilation is an event, as that of numba's other functions is."""

    def _compile_uncached(self) -> Any:
        with event.trigger_event("numba:compile", data={"dispatcher": self}):
            return super()._compile_uncached()  # type: ignore[misc]


@cache
def _stamp() -> tuple[float, int]:
    """Latest change and total size of the files that hold compiled code."""
    package = Path(__file__).parent
    files = [package / "kernel.py", *package.rglob("_*.py")]
    found = [file.stat() for file in files if file.name != "__init__.py"]
    return max(status.st_mtime for status in found), sum(status.st_size for status in found)


@cache
def _spare_folder() -> str:
    """Folder for compiled code among the temporary ones, this user's alone; "" and a warning without.

    What is kept there is run: a folder that others own or can write to is not used.
    """
    user = str(os.getuid()) if hasattr(os, "getuid") else "user"
    folder = Path(tempfile.gettempdir()) / f"hdsim-compiled-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        mine = not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
        if mine and stat.S_ISDIR(status.st_mode) and os.access(folder, os.W_OK):
            return str(folder)
    except OSError:
        pass
    warnings.warn(
        "compiled code cannot be kept, every process compiles anew: neither the package's folder nor the "
        f"user's cache folder nor {folder} can be written; set NUMBA_CACHE_DIR to one that can",
        RuntimeWarning,
        stacklevel=4,
    )
    return ""


def _keep(compiled: Any) -> None:
    """Keep ``compiled`` on disk, in an entry that also depends on the stamp of all files."""
    usual = config.CACHE_DIR
    try:
        compiled.enable_caching()
    except RuntimeError:  # numba found no folder that can be written
        config.CACHE_DIR = _spare_folder()
        if not config.CACHE_DIR:
            return
        compiled.enable_caching()
    finally:
        config.CACHE_DIR = usual
    file = compiled._cache._cache_file
    file._source_stamp = (file._source_stamp, _stamp())


def compiled(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function for calls from Python and from other compiled functions.

    Args:
        function: the function; left out when used with options.
        options: those of ``numba.njit``, over ``nogil=True, error_model="numpy"``.
    """
    if function is None:
        return lambda given: compiled(given, **options)
    dispatcher = njit(**({"nogil": True, "error_model": "numpy"} | options))(function)
    _keep(dispatcher)
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function that becomes part of every compiled function that calls it.

    A call hands over seven numbers for each array, most of them by way of the stack. For what a right-hand
    side of 200 ns calls this is a third of its time.
    """
    return compiled(function, forceinline=True)


def compiled_address(function: Callable[..., None], signature: Any) -> Any:
    """Compile a kernel to a C function; the result's ``address`` is valid as long as the result lives."""
    types = (signature.args, signature.return_type)
    callback = _Callback(function, types, locals={}, options={"error_model": "numpy"})
    _keep(callback)
    callback.compile()
    return callback
