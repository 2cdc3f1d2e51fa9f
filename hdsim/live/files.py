"""A finished log and its layouts over HTTP, for viewers that open what an address names."""

from __future__ import annotations

import json
import re
import threading
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from urllib.parse import parse_qsl, quote, urlencode, urlsplit, urlunsplit

from hdsim.errors import InputError
from hdsim.live.web import LOOPBACK, File, Server, host_of
from hdsim.log import scan
from hdsim.log.info import LogInfo, info_log
from hdsim.log.layout import layouts_of_log, to_json
from hdsim.log.reader import read_attachments

DEFAULT_PORT = 8766
SLOWEST, FASTEST = 0.01, 5.0
"""Playback speeds of a file that viewers have, multiples of real time."""

VIEWERS = {
    "lichtblick": "https://lichtblick-suite.github.io/lichtblick/",
    "foxglove": "https://app.foxglove.dev/~/view",
}
"""Addresses of viewers that everybody can open, by name."""

_LAYOUT = re.compile(r"layout-(.+)\.json")


def layouts_of(path: Path, about: LogInfo) -> dict[str, str]:
    """Layouts of a log by name, the first one first: those attached to it, or new ones where none are."""
    attached = {
        name: data.decode() for name, data in read_attachments(path).items() if _LAYOUT.fullmatch(name)
    }
    found = attached or layouts_of_log(about.fields, about.duration, about.drive_radius, about.facts)
    return {name.removeprefix("layout-").removesuffix(".json"): text for name, text in found.items()}


class FileServer:
    """Serves one log and its layouts on the loopback address: nothing else of the folder, and to nobody else.

    A page of a browser gets them only if it comes from the viewer's address or from this machine. The log is
    what it was when this began, even if it is written anew.

    Args:
        path: the log.
        viewer: address of the viewer that the pages come from, or one of `VIEWERS`.
        layout: name of the layout to open; the first one by default.
        speed: playback speed of the layouts, a multiple of real time; their own by default.
        port: 0 for any that is free.
        on_refused: called with the origin of a page that was refused, once for each.

    Attributes:
        log_address: where the log is.
        layouts: names of the layouts, the one to open first.
        layout_address: where that one is; None for a log that has none.
        takes_layout: whether the viewer opens a layout that its address names. Foxglove opens only those that
            it keeps itself (https://docs.foxglove.dev/docs/visualization/shareable-links).
        speed: playback speed of the layout to open; 1 without one.
        about: the log.

    Raises:
        InputError: the log cannot be read, has no such layout, the viewer's address is none, viewers have no
            such speed, or the port is taken.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        viewer: str = "lichtblick",
        layout: str | None = None,
        speed: float | None = None,
        port: int = DEFAULT_PORT,
        on_refused: Callable[[str], object] = lambda origin: None,
    ) -> None:
        path = Path(path)
        if speed is not None and not SLOWEST <= speed <= FASTEST:
            raise InputError(
                f"--speed: found {speed:g}, viewers play a file at {SLOWEST:g} to {FASTEST:g} times real time"
            )
        self.viewer = VIEWERS.get(viewer, viewer)
        self.about = info_log(path)
        layouts = layouts_of(path, self.about)
        if layout is not None and layout not in layouts:
            raise InputError(f"--layout: found {layout}, {path} has: {', '.join(layouts) or 'none'}")
        changed = path.stat().st_mtime_ns
        data = scan.map_file(path)
        name = f"{path.stem}.mcap"
        files = {name: File(data, "application/octet-stream", f'"{len(data):x}-{changed:x}"')}
        for key, text in layouts.items():
            files[f"layout-{key}.json"] = _layout_file(text, speed)
        self._server = Server(files, _origin(self.viewer), port, on_refused)
        self.port = int(self._server.server_address[1])
        self.log_address = self._address(name)
        chosen = layout or next(iter(layouts), None)
        self.layouts = sorted(layouts, key=lambda name: name != chosen)
        self.layout_address = None if chosen is None else self._address(f"layout-{chosen}.json")
        self.takes_layout = host_of(self.viewer) != host_of(VIEWERS["foxglove"])
        self.speed = 1.0 if speed is None else speed
        if speed is None and chosen is not None:
            self.speed = float(json.loads(layouts[chosen]).get("playbackConfig", {}).get("speed", self.speed))
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    def _address(self, name: str) -> str:
        # Viewers take a comma for the end of one address and the beginning of the next.
        return f"http://{LOOPBACK}:{self.port}/{quote(name, safe='')}"

    def viewer_address(self, live: str | None = None) -> str:
        """The viewer's address that opens the log, or a websocket, with the layout.

        Args:
            live: address of a websocket that is to be shown in place of the file.
        """
        source = {"ds": "remote-file", "ds.url": self.log_address}
        if live is not None:
            source = {"ds": "foxglove-websocket", "ds.url": live}
        if self.layout_address is not None and self.takes_layout:
            source["layoutUrl"] = self.layout_address
        return with_query(self.viewer, source)

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(5)


def with_query(address: str, values: Mapping[str, str]) -> str:
    """An address with more parameters, the ones it has kept."""
    parts = urlsplit(address)
    query = urlencode({**dict(parse_qsl(parts.query)), **values}, safe="/:")
    return urlunsplit(parts._replace(path=parts.path or "/", query=query))


def _layout_file(text: str, speed: float | None) -> File:
    if speed is not None:
        layout = json.loads(text)
        layout["playbackConfig"] = {**layout.get("playbackConfig", {}), "speed": speed}
        text = to_json(layout)
    data = text.encode()
    return File(data, "application/json", f'"{zlib.crc32(data):x}"')


def _origin(address: str) -> str:
    """Scheme, host and port of an address, as browsers name where a page comes from."""
    try:
        parts = urlsplit(address)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise InputError(
            f"--viewer: found {address}, expected {' or '.join(VIEWERS)} or an address such as http://localhost:8080"
        )
    standard = {"http": 80, "https": 443}[parts.scheme]
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    return f"{parts.scheme}://{host}" + (f":{port}" if port not in (None, standard) else "")
