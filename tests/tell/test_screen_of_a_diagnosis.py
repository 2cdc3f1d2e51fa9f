"""The terminal: a bar while a diagnosis runs, then what it found."""

from rich.console import Console

from hdsim.tell.terminal import Progress, show
from hdsim.tell.wording import headline
from hdsim.tell.words import unit_of


def test_the_terminal_shows_verdict_and_gaps_in_80_columns(found):
    terminal = Console(width=80, record=True, force_terminal=True, quiet=False, file=open("/dev/null", "w"))  # noqa: SIM115
    show(found, terminal)
    lines = terminal.export_text().splitlines()
    assert max(map(len, lines)) <= 80
    text = "\n".join(lines)
    assert headline(found) in " ".join(text.split())
    gap = found.verdict.gap["motor_torque"]
    row = next(line for line in lines if line.strip().startswith("motor torque ("))
    for value in (gap.before, gap.refit, gap.after, gap.noise):
        assert f"{unit_of(gap).factor * value:.3g}" in row.split()


def test_the_bar_never_goes_back_and_is_silent_off_a_terminal(capsys):
    with Progress(Console(stderr=True, force_terminal=False)) as tell:
        tell("locating")
    assert capsys.readouterr() == ("", "")
    bar = Progress(Console(stderr=True, force_terminal=True))
    with bar as tell:
        done = []
        for text in ("checking the data", "screening the catalogue", "locating the residual", "[odd] detail"):
            tell(text)
            done.append(bar._done)
    assert done == sorted(done)
    assert done[-1] == 40
