"""Where tables are printed: as wide as the terminal, and wide enough to lose nothing in a file or a pipe."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
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
