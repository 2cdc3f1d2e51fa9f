"""``--threads``: so many simulations at the same time, while the command lasts."""

import threading
import time

import click
from click.testing import CliRunner

from hdsim.simulation.ensemble import in_order
from hdsim.tell.commands_shared import measured_options


def workers():
    def here(_):
        time.sleep(0.01)
        return threading.get_ident()

    return len(set(in_order(here, range(12))) - {threading.get_ident()})


@click.command()
@measured_options
def command(**_):
    click.echo(f"{workers()} workers")


def test_simulations_go_in_as_many_threads_as_are_said(tmp_path):
    model = tmp_path / "model.yaml"
    model.touch()
    given = [str(model), "--model", str(model), "--out", str(tmp_path / "out")]
    before = workers()
    for count, wanted in ((1, 0), (2, 2), (3, 3)):
        result = CliRunner().invoke(command, [*given, "--threads", str(count)])
        assert result.output == f"{wanted} workers\n"
    assert workers() == before
    refused = CliRunner().invoke(command, [*given, "--threads", "0"])
    assert refused.exit_code == 2
    assert "0 is not in the range x>=1" in refused.output
