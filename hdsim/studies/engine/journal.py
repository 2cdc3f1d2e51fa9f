"""The results file that grows while a study runs: JSON lines, each on the disk before the next batch counts.

The first line names the study (a hash of its definition and of hdsim's code); a file of another study is
refused. A line cut off by a kill is dropped, so its run is made again.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from hdsim.errors import InputError
from hdsim.studies.engine.worker import Row

_FORMAT = "hdsim study 1"


@cache
def code_version() -> str:
    """Version of hdsim with a hash of its source files: results of other code are not continued."""
    from importlib.metadata import version

    root = Path(__file__).parents[2]
    total = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        total.update(path.relative_to(root).as_posix().encode())
        total.update(path.read_bytes())
    return f"{version('hdsim')}+{total.hexdigest()[:16]}"


def key_of(definition: dict[str, Any]) -> str:
    """Hash of everything that decides a study's results."""
    text = json.dumps(definition | {"code": code_version()}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _lock(file: IO[bytes], path: Path) -> None:
    """Keep a second study away from the file; the lock ends with the process, even when that is killed."""
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(f"{path} is in use by another study that is still running") from None


class Journal:
    """Rows of the runs that are done, in a file.

    Args:
        path: the file.
        key: the study's hash.
        fresh: start again, whatever the file holds.

    Attributes:
        rows: what is done, by run index.

    Raises:
        InputError: the file belongs to another study, or cannot be written.
    """

    def __init__(self, path: Path, key: str, *, fresh: bool = False) -> None:
        self.path, self.key = path, key
        self.rows: dict[int, Row] = {}
        self._file: IO[bytes] | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            good = 0
            if not fresh and path.exists():
                good = self._read()
            self._file = path.open("r+b" if path.exists() else "w+b")
            _lock(self._file, path)
            self._file.seek(good)
            self._file.truncate()
            if not good:
                self._append([{"format": _FORMAT, "key": key}])
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from error

    def _read(self) -> int:
        """Read what is there; returns the number of bytes that are whole lines."""
        good = 0
        with self.path.open("rb") as file:
            for number, line in enumerate(file):
                if not line.endswith(b"\n"):
                    break
                try:
                    entry = json.loads(line)
                    if number == 0:
                        self._check(entry)
                    else:
                        row = Row(entry["run"], entry["metrics"], entry["reason"], entry["seconds"])
                        self.rows[row.index] = row
                except (ValueError, KeyError, TypeError):
                    if number == 0:
                        raise InputError(f"{self.path} is no results file of a study") from None
                    break
                good += len(line)
        return good

    def _check(self, entry: Any) -> None:
        if entry["format"] != _FORMAT or entry["key"] != self.key:
            raise InputError(
                f"{self.path} holds results of another study, or of another version of hdsim; "
                f"use --fresh to start again, or -o for another folder"
            )

    def add(self, rows: Sequence[Row]) -> None:
        """Write rows; they are on the disk when this returns."""
        for row in rows:
            self.rows[row.index] = row
        self._append(
            [
                {
                    "run": row.index,
                    "metrics": row.metrics,
                    "reason": row.reason,
                    "seconds": round(row.seconds, 4),
                }
                for row in rows
            ]
        )

    def _append(self, entries: Sequence[dict[str, Any]]) -> None:
        assert self._file is not None
        # json writes a float by its repr, which brings back the same double.
        self._file.write(b"".join(json.dumps(entry).encode() + b"\n" for entry in entries))
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
