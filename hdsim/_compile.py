"""Compilation by numba with a cache on disk that notices a change in any compiled file (imports numba).

numba's own cache watches only the file of the function itself: change a function that is called from
another file, and the caller goes on running the old code. Here the stamp of a cache entry covers every file
whose code can end up in compiled functions: the package's ``_*.py`` files and ``kernel.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.ccallback import CFunc


@cache
def _stamp() -> tuple[float, int]:
    """Latest change and total size of the files that hold compiled code."""
    package = Path(__file__).parent
    files = [package / "kernel.py", *package.rglob("_*.py")]
    found = [file.stat() for file in files if file.name != "__init__.py"]
    return max(status.st_mtime for status in found), sum(status.st_size for status in found)


def _watch_all_files(compiled: Any) -> None:
    """Let the cache entry of ``compiled`` also depend on the stamp of all files."""
    file = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if file is not None:
        file._source_stamp = (file._source_stamp, _stamp())


def compiled(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function for calls from Python and from other compiled functions.

    Args:
        function: the function; left out when used with options.
        options: those of ``numba.njit``, over ``nogil=True, error_model="numpy"``.
    """
    if function is None:
        return lambda given: compiled(given, **options)
    dispatcher = njit(**({"cache": True, "nogil": True, "error_model": "numpy"} | options))(function)
    _watch_all_files(dispatcher)
    return dispatcher


def compiled_address(function: Callable[..., None], signature: Any) -> Any:
    """Compile a kernel to a C function; the result's ``address`` is valid as long as the result lives."""
    types = (signature.args, signature.return_type)
    callback = CFunc(function, types, locals={}, options={"error_model": "numpy"})
    callback.enable_caching()
    _watch_all_files(callback)
    callback.compile()
    return callback
