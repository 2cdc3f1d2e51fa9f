"""The command ``replay``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from hdsim.live.files import FileServer
    from hdsim.live.session import LiveReplay


@click.command()
@click.argument("log", type=click.Path(path_type=Path))
@click.option("--open", "show", is_flag=True, help="Open the viewer in the browser.")
@click.option(
    "--viewer",
    default="lichtblick",
    show_default=True,
    help="lichtblick, foxglove, or the address of another Lichtblick.",
)
@click.option("--layout", help="Layout to open [default: the log's first one].")
@click.option("--live", is_flag=True, help="Stream the log over a websocket in place of the file.")
@click.option(
    "--speed",
    type=click.FloatRange(1e-4, 1e4),
    help="Multiple of real time [default: that of the layout].",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    help="0: any free one [default: 8766, with --live 8765].",
)
@click.option("--host", help="Of --live, address to listen at [default: 127.0.0.1].")
def replay(
    log: Path,
    show: bool,
    viewer: str,
    layout: str | None,
    live: bool,
    speed: float | None,
    port: int | None,
    host: str | None,
) -> None:
    """Serve the finished LOG and its layouts to a viewer on this machine, until interrupted."""
    from hdsim.errors import InputError
    from hdsim.live import files, web

    if host is not None and not live:
        raise InputError(f"--host: found {host}; a file is served on {web.LOOPBACK} only, see --live")

    def refused(origin: str) -> None:
        click.echo(f"a page of {origin} was refused; --viewer names the viewer's address", err=True)

    # A live viewer gets the layout as a file, too.
    served = files.FileServer(
        log,
        viewer=viewer,
        layout=layout,
        speed=None if live else speed,
        port=0 if live else files.DEFAULT_PORT if port is None else port,
        on_refused=refused,
    )
    session = None
    try:
        if live:
            from hdsim.live.server import DEFAULT_PORT
            from hdsim.live.session import LiveReplay

            session = LiveReplay(
                log,
                speed=served.speed if speed is None else speed,
                host=host or web.LOOPBACK,
                port=DEFAULT_PORT if port is None else port,
            )
        address = served.viewer_address(None if session is None else session.address)
        click.echo("\n".join([*_lines(served, session), f"viewer   {address}"]))
        if show:
            import webbrowser

            if not webbrowser.open(address):
                click.echo("no browser was found; open the address by hand", err=True)
        while True:
            time.sleep(0.2)
    finally:
        if session is not None:
            session.close()
        served.close()


def _lines(served: FileServer, session: LiveReplay | None) -> list[str]:
    """What is served where."""
    if session is None:
        found = [f"log      {served.log_address}, plays at {served.speed:g} times real time; Ctrl-C ends"]
    else:
        speed = session.player.state.speed
        length = f"{served.about.duration:g} s at {speed:g} times real time"
        found = [f"live     {session.address}, {length}; Ctrl-C ends"]
    if served.layout_address is None:
        return found
    if not served.takes_layout:
        return [
            *found,
            f"layout   {served.layout_address}: save it, and import it in the viewer's menu Layouts",
        ]
    first, *others = served.layouts
    return [*found, f"layout   {first}" + (f" (--layout for {', '.join(others)})" if others else "")]
