"""The command line. A command's module is imported when the command is invoked, not before."""

from __future__ import annotations

import importlib
import sys
import warnings
from typing import Any

import click

from hdsim.errors import HdsimError, PluginWarning

#: Where each command lives, and its line in ``hdsim --help``.
COMMANDS: dict[str, tuple[str, str]] = {
    "run": ("hdsim.simulation.commands:run", "Simulate a scenario, write its log, draw its figure."),
    "examples": ("hdsim.scenario.commands:examples", "List the scenarios that come with hdsim."),
    "new": ("hdsim.scenario.commands:new", "Copy an example, or begin an effect of your own."),
    "check": ("hdsim.scenario.commands:check", "Check scenarios, mappings and studies; say what they are."),
    "schema": ("hdsim.scenario.commands:schema", "Print the JSON schema of scenarios or other files."),
    "effects": ("hdsim.scenario.commands:effects", "List the physical effects that a scenario can turn on."),
    "presets": ("hdsim.studies.commands:presets", "List the drives that are ready to use."),
    "catalogue": (
        "hdsim.studies.commands:catalogue",
        "Simulate a preset's catalogue lines; print the errors.",
    ),
    "bench": ("hdsim.studies.commands:bench", "Measure a drive as a test bench does, beside its catalogue."),
    "select": ("hdsim.studies.commands_select:select", "Find the size that carries a load cycle."),
    "study": ("hdsim.studies.commands_engine:study", "Run a study: parameters, replicates, metrics."),
    "budget": ("hdsim.studies.commands_engine:budget", "Split a positioning error into its causes."),
    "tolerance": (
        "hdsim.studies.commands_engine:tolerance",
        "Find the largest tolerance that meets an accuracy.",
    ),
    "linearize": (
        "hdsim.simulation.commands_linear:linearize",
        "Linearise a drive; its modes and Bode plot.",
    ),
    "reproduce": ("hdsim.reproduce.commands:reproduce", "Recompute every number of the source paper."),
    "validate": (
        "hdsim.validate.commands:validate",
        "Compare hdsim with printed, measured and independent values.",
    ),
    "surface": ("hdsim.surface.commands:surface", "Find D and G of a measured flank."),
    "plot": ("hdsim.plot.commands:plot", "Draw the one-page figure of a log."),
    "import": ("hdsim.log.import_commands:import_data", "Turn a measured recording into a log."),
    "mapping": ("hdsim.log.mapping_commands:mapping", "Draft a mapping of a measured recording."),
    "replay": ("hdsim.live.commands:replay", "Serve a finished log and its layouts to a viewer."),
    "info": ("hdsim.log.commands:info", "Show what is in a log."),
    "export": ("hdsim.export.commands:export", "Write a log or a scenario for other programs."),
    "verify": ("hdsim.log.commands:verify", "Check every record of a log."),
    "layout": ("hdsim.log.commands:layout", "Print a layout that shows a log in Foxglove."),
    "fit": ("hdsim.tell.fit_commands:fit", "Estimate a scenario's parameters from measured records."),
    "diagnose": (
        "hdsim.tell.commands:diagnose",
        "Find which physical effect a model is missing.",
    ),
    "recover": ("hdsim.log.commands:recover", "Save what a damaged or unfinished log holds."),
}


class LazyGroup(click.Group):
    """A group that knows its commands by name and imports one only to run it."""

    def list_commands(self, context: click.Context) -> list[str]:
        """Names, in the order of the table."""
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Import a command.

        Raises:
            click.UsageError: (by click) when there is none of that name.
        """
        if name not in COMMANDS:
            return None
        module, _, function = COMMANDS[name][0].partition(":")
        command: click.Command = getattr(importlib.import_module(module), function)
        return command

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands from the table, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])

    def resolve_command(
        self, context: click.Context, arguments: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command; an unknown one is refused with the nearest known."""
        name = arguments[0]
        if name not in COMMANDS and not name.startswith("-"):
            from difflib import get_close_matches

            near = get_close_matches(name, COMMANDS, 1)
            hint = f" Did you mean {near[0]!r}?" if near else f" There are: {', '.join(COMMANDS)}."
            context.fail(f"No command {name!r}.{hint}")
        return super().resolve_command(context, arguments)


def _print_version(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        from importlib.metadata import version

        click.echo(f"hdsim {version('hdsim')}")
        context.exit()


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.option("--debug", is_flag=True, help="Show the Python traceback of an error.")
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Show the version.",
)
@click.pass_context
def hdsim(context: click.Context, debug: bool) -> None:
    """Simulate harmonic drives, from the rough tooth flank to the log."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """Say in a line what another package does wrong; everything else as Python does."""
    if issubclass(category, PluginWarning):
        click.echo(f"warning: {message}", err=True)
    else:
        _pythons_way(message, category, *where, **more)


_pythons_way = warnings.showwarning


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 a check failed, 2 bad input, 130 interrupted.

    Args:
        arguments: what follows ``hdsim``; those of the process when None.

    Raises:
        SystemExit: always.
    """
    given = sys.argv[1:] if arguments is None else arguments
    # Taken from the raw arguments, because the error may come before click has read them.
    debug = "--debug" in given
    warnings.showwarning = _show_warning
    try:
        result: Any = hdsim.main(args=given, prog_name="hdsim", standalone_mode=False)
    except click.ClickException as error:
        if debug:
            raise
        context = getattr(error, "ctx", None)
        hint = f" (see '{context.command_path} --help')" if context is not None else ""
        click.echo(f"error: {' '.join(error.format_message().split())}{hint}", err=True)
        sys.exit(2)
    except HdsimError as error:
        if debug:
            raise
        for line in str(error).split("\n"):
            click.echo(f"error: {line}", err=True)
        sys.exit(2)
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted", err=True)
        sys.exit(130)
    except BrokenPipeError:
        # The reader of a pipe went away (``| head``); flushing the rest at exit would complain again.
        sys.stdout = None
        sys.exit(0)
    sys.exit(result if isinstance(result, int) else 0)


if __name__ == "__main__":
    main()
