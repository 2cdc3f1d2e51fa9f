"""The command line itself: quick, lazy, and without tracebacks."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path

import click
import pytest

from hdsim import cli
from hdsim.errors import InputError, PhysicsError

HEAVY = ("numba", "scipy", "control", "matplotlib", "pyarrow", "mcap")
SCENARIOS = sorted((Path(__file__).parents[2] / "scenarios").glob("*.yaml"))


def run_main(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    out, err = capsys.readouterr()
    assert isinstance(stopped.value.code, int)
    return stopped.value.code, out, err


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_listed_command_exists(name: str) -> None:
    home, _ = cli.COMMANDS[name]
    module, _, function = home.partition(":")
    command = getattr(importlib.import_module(module), function)
    assert isinstance(command, click.Command)
    assert command.name == name


def imported_by(arguments: list[str]) -> set[str]:
    code = (
        "import sys\nfrom hdsim.cli import main\n"
        f"try:\n    main({arguments!r})\nexcept SystemExit as stop:\n    assert not stop.code, stop.code\n"
        "sys.stderr.write(chr(10).join({name.partition('.')[0] for name in sys.modules}))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stderr.split("\n"))


def test_help_imports_neither_numpy_nor_pydantic() -> None:
    modules = imported_by(["--help"])
    assert "click" in modules
    assert not modules & {*HEAVY, "numpy", "pydantic", "ruamel", "rich"}


def test_checking_imports_nothing_heavy() -> None:
    modules = imported_by(["check", *map(str, SCENARIOS)])
    assert {"pydantic", "ruamel"} <= modules
    assert not modules & set(HEAVY)


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in ([], ["--help"], ["-h"]):
        code, out, err = run_main(arguments, capsys)
        assert (code, err) == (0, "")
        assert all(f"  {name}" in out and line[:25] in out for name, (_, line) in cli.COMMANDS.items())


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    from importlib.metadata import version

    assert run_main(["--version"], capsys) == (0, f"hdsim {version('hdsim')}\n", "")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["chek"], "Did you mean 'check'?"),
        (["xyzzy"], "There are: "),
        (["check"], "Missing argument 'FILE...'"),
        (["check", "--loud", "x"], "No such option"),
        (["--loud"], "No such option"),
        (["schema", "-o"], "requires an argument"),
        (["schema", "-o", "no/such/folder/x.json"], "cannot be written"),
    ],
)
def test_wrong_use_gives_one_line(
    arguments: list[str], part: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, err = run_main(arguments, capsys)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert part in err


@pytest.mark.parametrize(
    ("raised", "code", "text"),
    [
        (InputError("x.yaml: wrong\ny.yaml: too"), 2, "error: x.yaml: wrong\nerror: y.yaml: too\n"),
        (PhysicsError("no such drive"), 2, "error: no such drive\n"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
        (click.Abort(), 130, "interrupted\n"),
    ],
)
def test_errors_become_exit_codes(
    raised: BaseException,
    code: int,
    text: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    @click.command()
    def failing() -> None:
        raise raised

    module = type(sys)("failing_module")
    module.failing = failing  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "failing_module", module)
    monkeypatch.setitem(cli.COMMANDS, "failing", ("failing_module:failing", "Fails."))
    found, out, err = run_main(["failing"], capsys)
    # On an interrupt click ends the terminal's current line first.
    assert (found, out, err.removeprefix("\n")) == (code, "", text)
    if isinstance(raised, InputError):
        with pytest.raises(InputError):
            cli.main(["--debug", "failing"])


def test_effects_lists_the_catalogue(capsys: pytest.CaptureFixture[str]) -> None:
    from hdsim.effects import catalogue

    code, out, _ = run_main(["effects"], capsys)
    assert code == 0
    assert all(name in out for name in catalogue())


def test_schema_is_printed_or_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "hdsim.schema.json"
    code, out, _ = run_main(["schema", "-o", str(file)], capsys)
    assert code == 0
    assert f"# yaml-language-server: $schema={file}" in out
    _, printed, _ = run_main(["schema"], capsys)
    assert json.loads(printed) == json.loads(file.read_text())
