"""The terminal output of a diagnosis: a bar while it runs, then the verdict and the residuals."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hdsim.console import console
from hdsim.tell.because import conditions, weighings
from hdsim.tell.beside import also_moved, baselines, last_model
from hdsim.tell.findings import Findings
from hdsim.tell.tables import gap_rows, with_curve_words
from hdsim.tell.wording import KINDS, headline, sureness
from hdsim.tell.words import FROM_ALL_DATA, odds, percent, title_of

if TYPE_CHECKING:
    from rich.console import Console

    from hdsim.diagnosis.verdict import Verdict

#: Progress in percent at the beginning of each step. Locating and identifying are repeated as long as
#: something is found, so that the bar waits there.
STEPS = {
    "checking the data": 2,
    "predicting": 5,
    "re-fitting": 10,
    "locating": 35,
    "screening": 40,
    "fitting the shortlist": 55,
    "testing each effect again": 70,
    "fitting the curve": 75,
    "validating": 90,
    "finding the next experiment": 95,
}
#: Narrow enough for 80 columns.
_HEAD = ("channel", "before", "re-fit", "after", "noise", "after/\nbefore", "after/\nnoise")
_STYLE: dict[str, Any] = {"title_justify": "left", "title_style": "bold", "header_style": "bold"}
_COLOURS = {"nothing": "green", "parameter": "blue", "effect": "dark_orange", "unknown": "magenta"}


class Progress:
    """A bar and a line that says what is being done, on a terminal; nothing elsewhere."""

    def __init__(self, terminal: Console | None = None) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        self._console = terminal or Console(stderr=True)
        columns = (SpinnerColumn(), BarColumn(24), TimeElapsedColumn(), TextColumn("{task.description}"))
        self._bar = Bar(*columns, console=self._console, transient=True)
        self._done = 0

    def __enter__(self) -> Callable[[str], object]:
        if not self._console.is_terminal:
            return lambda text: None
        self._bar.start()
        self._task = self._bar.add_task("", total=100)
        return self.tell

    def __exit__(self, *_: object) -> None:
        if self._console.is_terminal:
            self._bar.stop()

    def tell(self, text: str) -> None:
        """Show what is being done."""
        from rich.markup import escape

        reached = [percent for start, percent in STEPS.items() if text.startswith(start)]
        self._done = max([self._done, *reached])
        self._bar.update(self._task, completed=self._done, description=escape(text))


def show(found: Findings, terminal: Console | None = None) -> None:
    """Print the verdict, its confidence, the held-out residuals, the evidence, and what needs attention."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    verdict, sure = found.verdict, sureness(found)
    out = terminal or console()

    def line(*parts: tuple[str, str] | str) -> None:
        out.print(Text.assemble(*parts), highlight=False)

    line((verdict.verdict, f"bold {_COLOURS[verdict.verdict]}"), ": ", (KINDS[verdict.verdict], "bold"))
    line(headline(found))
    line(sure.sentence)
    if beside := also_moved(verdict):
        line(beside)
    if verdict.estimated_from == "all":
        line(FROM_ALL_DATA)
    if verdict.gap:
        table = Table(box=SIMPLE_HEAD, title="\nRMS residual on held-out data", **_STYLE)
        for name in _HEAD:
            table.add_column(name, justify="left" if name == "channel" else "right")
        for channel, unit, *numbers in gap_rows(verdict):
            table.add_row(f"{channel} ({unit})", *numbers)
        out.print(table)
        for said in baselines(verdict.gap, last_model(verdict)):
            line(said)
    for title, head, rows in _reasons(verdict):
        table = Table(box=SIMPLE_HEAD, title=title, **_STYLE)
        for name in head:
            table.add_column(name, justify="right" if name == "observed" else "left", no_wrap=name != head[0])
        for row in rows:
            table.add_row(*row)
        out.print(table)
    for effect in verdict.effects:
        for other in effect.indistinguishable_from:
            why = effect.separated_by.get(other)
            if why:
                line((f"{effect.name} or {other}", "bold"), f": {why}")
    if verdict.curve is not None:
        proved = with_curve_words(verdict)
        said = f"; with it held-out residuals are {proved}" if proved else ""
        line(("curve", "bold"), f": {verdict.curve.words}, explains {percent(verdict.curve.share)}{said}")
    if verdict.next_experiment is not None:
        line(("next", "bold"), f": {verdict.next_experiment.sentence}")
    for problem in verdict.data_problems:
        if problem.severity != "info":
            style = "bold red" if problem.severity == "error" else "yellow"
            line((problem.severity, style), f": {problem.record}: {problem.channel}: {problem.message}")


def _reasons(verdict: Verdict) -> list[tuple[str, tuple[str, ...], list[list[str]]]]:
    """Title, columns and rows of the tables that say why."""
    found: list[tuple[str, tuple[str, ...], list[list[str]]]] = []
    for one in weighings(verdict.because):
        rows = [[w.words, w.seen, odds(w.log_odds)] for w in one.weights]
        said = f"{percent(one.probability)}, {'identified' if one.named else 'not identified'}"
        found.append((f"Why: {title_of(one.name)} ({said})", ("evidence", "observed", "odds"), rows))
    rows = [[c.words, c.seen, c.limit, "yes" if c.met else "no"] for c in conditions(verdict.because)]
    if rows:
        found.append(("Why", ("criterion", "observed", "threshold", "met"), rows))
    return found
