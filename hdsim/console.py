"""Where tables are printed: as wide as the terminal, and wide enough to lose nothing in a file or a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

#: Columns of the output when it does not go to a terminal.
PIPED_WIDTH = 160
#: Smallest file whose reading is shown by a bar.
LARGE_BYTES = 20_000_000


def console() -> Console:
    """A console on standard output."""
    from rich.console import Console

    found = Console()
    return found if found.is_terminal else Console(width=PIPED_WIDTH)


@contextmanager
def reading(path: Path) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal's error output while a large file is read; takes the share that has been."""
    from rich.console import Console
    from rich.progress import Progress

    if not path.is_file() or path.stat().st_size < LARGE_BYTES:
        yield lambda share: None
        return
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"reading {path.name}", total=1.0)
        yield lambda share: bar.update(task, completed=share)


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """Tell a terminal, on standard error, what is waited for and for how long already; nothing elsewhere.

    Worker processes say nothing: their parent has the terminal. Where a progress bar has it already, it is a
    plain line above the bar.
    """
    from multiprocessing import parent_process

    if not sys.stderr.isatty() or parent_process() is not None:
        yield
    elif hasattr(sys.stderr, "rich_proxied_file"):
        if what not in _since:
            print(what, file=sys.stderr)
        _since.setdefault(what, monotonic())
        yield
    else:
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            bar.add_task(what, total=None)
            bar.tasks[0].start_time = _since.setdefault(what, monotonic())
            yield


#: When something was waited for first: it may come in pieces.
_since: dict[str, float] = {}
