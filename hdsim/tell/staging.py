"""Results appear all together or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from hdsim.errors import InputError


@contextlib.contextmanager
def staged(out: Path, *, keep: bool = True) -> Iterator[Path]:
    """A new directory inside of ``out``, whose files move up into ``out`` when nothing went wrong.

    Args:
        out: made when it is not there; taken away again when it was not there and something went wrong.
        keep: false only tries whether ``out`` can be written.

    Raises:
        InputError: ``out`` cannot be written.
    """
    made = [folder for folder in (out, *out.parents) if not folder.exists()]
    finished = False
    try:
        out.mkdir(parents=True, exist_ok=True)
        stage = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=out))
        try:
            yield stage
            for path in stage.iterdir():
                os.replace(path, out / path.name)
            finished = keep
        finally:
            shutil.rmtree(stage, ignore_errors=True)
    except OSError as error:
        raise InputError(f"{out}: the results cannot be written: {error.strerror or error}") from None
    finally:
        if not finished:
            for folder in made:
                with contextlib.suppress(OSError):
                    folder.rmdir()
