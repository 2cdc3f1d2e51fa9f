"""Where tables are printed: as wide as the terminal, and wide enough to lose nothing in a file or a pipe."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

#: Columns of the output when it does not go to a terminal.
PIPED_WIDTH = 160


def console() -> Console:
    """A console on standard output."""
    from rich.console import Console

    found = Console()
    return found if found.is_terminal else Console(width=PIPED_WIDTH)
