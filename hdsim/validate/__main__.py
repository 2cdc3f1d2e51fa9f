"""``python -m hdsim.validate README.md --data DIR`` writes the table anew between its two marks in a page."""

from __future__ import annotations

from pathlib import Path

import click

from hdsim.errors import InputError
from hdsim.validate.report import to_markdown
from hdsim.validate.table import compute

BEGIN, END = "<!-- hdsim validate -->\n", "<!-- end -->\n"


@click.command()
@click.argument("page", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--data", type=click.Path(path_type=Path), help="Folder with the measured records.")
def main(page: Path, data: Path | None) -> None:
    """Write the table anew between its two marks in PAGE."""
    before, begin, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise InputError(f"{page}: found no {BEGIN.strip()} ... {END.strip()}")
    page.write_text(f"{before}{BEGIN}\n{to_markdown(compute(data=data))}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
