"""The command ``replay``."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("log", type=click.Path(path_type=Path))
@click.option("--live", is_flag=True, help="Serve the log to viewers over a websocket.")
@click.option(
    "--speed",
    type=click.FloatRange(1e-4, 1e4),
    help="Multiple of real time [default: one that suits the run].",
)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8765, show_default=True, help="0: any free one."
)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen at.")
def replay(log: Path, live: bool, speed: float | None, port: int, host: str) -> None:
    """Serve the finished LOG to live viewers, until interrupted."""
    from hdsim.errors import InputError
    from hdsim.log.info import info_log
    from hdsim.log.layout import playback_speed

    about = info_log(log)
    chosen = playback_speed(about.duration) if speed is None else speed
    if not live:
        raise InputError(f"open {log} in a viewer (playback speed {chosen:g}), or serve it with --live")

    from hdsim.live.session import LiveReplay

    session = LiveReplay(log, speed=chosen, host=host, port=port)
    try:
        click.echo(
            f"live     {session.address}, {about.duration:g} s at {chosen:g} times real time; Ctrl-C ends"
        )
        session.serve()
    finally:
        session.close()
