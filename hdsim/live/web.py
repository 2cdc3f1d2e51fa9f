"""A few files over HTTP on the loopback address, for the pages of a viewer: byte ranges, origins of pages."""

from __future__ import annotations

import errno
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import unquote, urlsplit

from hdsim.errors import InputError

LOOPBACK = "127.0.0.1"

_LOCAL = (LOOPBACK, "localhost", "::1")
_MOST_REFUSED = 20
_RANGE = re.compile(r"bytes=([0-9]{0,18})-([0-9]{0,18})")
_PIECE = 1 << 20
"""Bytes that are sent at once."""


@dataclass(frozen=True)
class File:
    """What is served under one name.

    Args:
        data: its bytes.
        media_type: for the head of the answer.
        tag: changes with the contents.
    """

    data: memoryview | bytes
    media_type: str
    tag: str


def host_of(address: str) -> str:
    """Name of the machine in an address; empty where there is none."""
    try:
        return urlsplit(address).hostname or ""
    except ValueError:
        return ""


class Server(ThreadingHTTPServer):
    """Serves files by name.

    Args:
        files: by the name in their address.
        origin: of pages that get them, besides those of this machine.
        port: 0 for any that is free.
        on_refused: called with the origin of a page that was refused, once for each.

    Raises:
        InputError: the port is taken.
    """

    daemon_threads = True
    allow_reuse_address = sys.platform != "win32"

    def __init__(
        self, files: Mapping[str, File], origin: str, port: int, on_refused: Callable[[str], object]
    ) -> None:
        self.files = files
        self._origin = origin
        self._on_refused = on_refused
        self._refused: set[str] = set()
        try:
            super().__init__((LOOPBACK, port), _Handler)
        except OSError as error:
            why = "the port is taken" if error.errno == errno.EADDRINUSE else error.strerror
            hint = "; --port takes another, --port 0 any that is free"
            raise InputError(f"cannot listen at {LOOPBACK}:{port}: {why}{hint}") from None

    def allows(self, origin: str) -> bool:
        """Whether pages of an origin get the files: those of the viewer, and of this machine."""
        if origin == self._origin or host_of(origin) in _LOCAL:
            return True
        if origin not in self._refused and len(self._refused) < _MOST_REFUSED:
            self._refused.add(origin)
            self._on_refused(origin)
        return False

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of viewers that hang up, as they do once they have read the head of an answer."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers GET with byte ranges (RFC 9110, 14), HEAD, and what browsers ask beforehand (CORS)."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "hdsim", ""
    server: Server
    _granted: str | None = None

    def do_GET(self) -> None:
        self._answer(body=True)

    def do_HEAD(self) -> None:
        self._answer(body=False)

    def do_OPTIONS(self) -> None:
        if self._allowed():
            self.send_response(HTTPStatus.NO_CONTENT)
            self.send_header("Access-Control-Allow-Methods", "GET, HEAD, OPTIONS")
            self.send_header("Access-Control-Allow-Headers", "Range, If-Range, Cache-Control, Pragma")
            self.send_header("Access-Control-Max-Age", "600")
            # A page from elsewhere asks whether it may come to this machine.
            if self.headers.get("Access-Control-Request-Private-Network") == "true":
                self.send_header("Access-Control-Allow-Private-Network", "true")
            self._end()

    def _allowed(self) -> bool:
        """Refuse other names of this machine, which a page may have bent to it, and pages from elsewhere."""
        origin = self.headers.get("Origin")
        self._granted = None
        if host_of(f"//{self.headers.get('Host', '')}") not in _LOCAL:
            self._refuse(HTTPStatus.MISDIRECTED_REQUEST, f"this is {LOOPBACK}")
        elif origin is not None and not self.server.allows(origin):
            self._refuse(HTTPStatus.FORBIDDEN, f"pages of {origin} get nothing")
        else:
            self._granted = origin
            return True
        return False

    def _answer(self, *, body: bool) -> None:
        if not self._allowed():
            return
        file = self.server.files.get(unquote(urlsplit(self.path).path).removeprefix("/"))
        if file is None:
            self._refuse(HTTPStatus.NOT_FOUND, f"there is: {', '.join(self.server.files)}")
            return
        size = len(file.data)
        part = self._part(size, file.tag) if body else None
        if part is not None and part[0] >= part[1]:
            self.send_response(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE)
            self.send_header("Content-Range", f"bytes */{size}")
            self.send_header("Content-Length", "0")
            self._end()
            return
        self.send_response(HTTPStatus.OK if part is None else HTTPStatus.PARTIAL_CONTENT)
        begin, end = part or (0, size)
        if part is not None:
            self.send_header("Content-Range", f"bytes {begin}-{end - 1}/{size}")
        self.send_header("Content-Type", file.media_type)
        self.send_header("Content-Length", str(end - begin))
        self.send_header("ETag", file.tag)
        self.send_header("Cache-Control", "no-store")
        self._end()
        for at in range(begin, end, _PIECE) if body else ():
            self.wfile.write(file.data[at : min(at + _PIECE, end)])

    def _part(self, size: int, tag: str) -> tuple[int, int] | None:
        """First byte and the one after the last of the range that is asked for; None for the whole file.

        A range of another form, or of several parts, counts as none, as the standard allows. An empty one
        cannot be answered.
        """
        asked = _RANGE.fullmatch(self.headers.get("Range", "").replace(" ", ""))
        if asked is None or self.headers.get("If-Range", tag) != tag:
            return None
        first, last = asked.groups()
        if not first:
            return (max(0, size - int(last)), size) if last else None
        if last and int(last) < int(first):
            return None
        return int(first), min(int(last) + 1, size) if last else size

    def _refuse(self, status: HTTPStatus, text: str) -> None:
        data = f"{text}\n".encode()
        self.send_response(status)
        self.send_header("Content-Type", "text/plain; charset=utf-8")
        self.send_header("Content-Length", str(len(data)))
        self._end()
        if self.command != "HEAD":
            self.wfile.write(data)

    def _end(self) -> None:
        """The head's end, with what every answer says."""
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("Vary", "Origin")
        if self._granted is not None:
            self.send_header("Access-Control-Allow-Origin", self._granted)
            exposed = "Accept-Ranges, Content-Length, Content-Range, ETag"
            self.send_header("Access-Control-Expose-Headers", exposed)
        self.end_headers()

    def log_message(self, format: str, *arguments: Any) -> None:
        """Say nothing: a viewer asks hundreds of times."""
