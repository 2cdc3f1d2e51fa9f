"""A log and its layouts over HTTP, asked as a viewer in a browser asks."""

from __future__ import annotations

import http.client
import json
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from urllib.parse import parse_qs, quote, unquote, urlsplit

import numpy as np
import pytest

from hdsim.errors import InputError
from hdsim.live.files import FileServer
from hdsim.log import LogWriter, read_attachments
from hdsim.recording import Column, Table

VIEWER = "http://viewer.example:8080"


def write(path: Path, layouts: bool = True) -> Path:
    time = np.arange(3000) * 1e-3
    columns = {
        name: Column(np.sin(time * (k + 1)), "rad") for k, name in enumerate(["motor_angle", "output_angle"])
    }
    with LogWriter(path, metadata={"scenario_name": "a"}, layouts=layouts) as log:
        log.write("state", Table(time, columns))
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    (folder / "secret.txt").write_text("not for viewers")
    write(folder / "other.mcap")
    return write(folder / "run, 1 µ.mcap")


@pytest.fixture
def server(log):
    served = FileServer(log, viewer=VIEWER + "/lichtblick/?x=1", port=0)
    yield served
    served.close()


def ask(address: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=10)
    # Header names as HTTP writes them: if_range is If-Range.
    connection.request(method, parts.path, headers={k.replace("_", "-"): v for k, v in headers.items()})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, {k.lower(): v for k, v in answer.getheaders()}, body


def test_the_whole_log_and_its_layouts_are_served(server, log):
    status, head, body = ask(server.log_address, Origin=VIEWER)
    assert (status, body) == (200, log.read_bytes())
    # What a viewer must see before it reads a file in parts.
    assert head["accept-ranges"] == "bytes"
    assert head["access-control-allow-origin"] == VIEWER
    assert {"accept-ranges", "content-length", "content-range", "etag"} <= set(
        head["access-control-expose-headers"].lower().split(", ")
    )
    assert server.layouts[0] == "overview"
    attached = read_attachments(log)
    for name in server.layouts:
        status, head, body = ask(server.layout_address.replace("overview", name), Origin=VIEWER)
        assert (status, head["content-type"]) == (200, "application/json")
        assert body == attached[f"layout-{name}.json"]


def test_ranges_are_answered_as_the_standard_says(server, log):
    whole = log.read_bytes()
    size = len(whole)
    for asked, begin, end in (
        ("bytes=0-0", 0, 1),
        ("bytes=100-299", 100, 300),
        (f"bytes={size - 5}-", size - 5, size),
        ("bytes=-7", size - 7, size),
        (f"bytes=-{size + 1}", 0, size),
        (f"bytes=10-{size + 1000}", 10, size),
    ):
        status, head, body = ask(server.log_address, Range=asked)
        assert (status, body) == (206, whole[begin:end]), asked
        assert head["content-range"] == f"bytes {begin}-{end - 1}/{size}"
        assert head["content-length"] == str(end - begin)
    for asked in (f"bytes={size}-", f"bytes={size + 5}-{size + 9}", "bytes=-0"):
        status, head, body = ask(server.log_address, Range=asked)
        assert (status, head["content-range"], body) == (416, f"bytes */{size}", b""), asked
    for asked in ("bytes=9-3", "bytes=-", "lines=1-2", "bytes=0-1,5-6", "bytes=" + "9" * 5000 + "-"):
        assert ask(server.log_address, Range=asked)[::2] == (200, whole), asked[:20]
    tag = ask(server.log_address)[1]["etag"]
    assert ask(server.log_address, Range="bytes=0-1", If_Range=tag)[0] == 206
    assert ask(server.log_address, Range="bytes=0-1", If_Range='"other"')[0] == 200


def test_a_head_has_no_body_and_no_range(server, log):
    status, head, body = ask(server.log_address, "HEAD", Range="bytes=0-3")
    assert (status, head["content-length"], body) == (200, str(log.stat().st_size), b"")


def test_a_browser_may_ask_whether_a_page_may_come_to_this_machine(server):
    asked = {"Access_Control_Request_Method": "GET", "Access_Control_Request_Headers": "range"}
    status, head, _ = ask(
        server.log_address, "OPTIONS", Origin=VIEWER, Access_Control_Request_Private_Network="true", **asked
    )
    assert status == 204
    assert head["access-control-allow-origin"] == VIEWER
    assert head["access-control-allow-private-network"] == "true"
    assert "range" in head["access-control-allow-headers"].lower()
    assert "GET" in head["access-control-allow-methods"]
    head = ask(server.log_address, "OPTIONS", Origin=VIEWER, **asked)[1]
    assert "access-control-allow-private-network" not in head


def test_pages_from_elsewhere_get_nothing_and_the_user_is_told(log):
    told = []
    served = FileServer(log, viewer=VIEWER, port=0, on_refused=told.append)
    try:
        for _ in range(2):
            for method in ("GET", "OPTIONS"):
                status, head, body = ask(served.log_address, method, Origin="https://else.example")
                assert status == 403
                assert "access-control-allow-origin" not in head
                assert len(body) < 100
        assert told == ["https://else.example"]
        assert ask(served.log_address, Origin="http://localhost:3000")[0] == 200
        # A page that has bent its own name to this machine comes without an origin, but with that name.
        assert ask(served.log_address, Host="else.example")[0] == 421
    finally:
        served.close()


def test_nothing_else_of_the_folder_is_served(server, log):
    base = server.log_address.rsplit("/", 1)[0]
    for path in ("/", "/secret.txt", "/other.mcap", "/../secret.txt", "/%2e%2e/secret.txt", quote(str(log))):
        status, _, body = ask(base + path)
        assert status == 404, path
        assert b"not for viewers" not in body


def test_the_viewers_address_names_log_and_layout(server, log):
    address = server.viewer_address()
    assert address.startswith(VIEWER + "/lichtblick/?x=1&ds=remote-file&")
    query = parse_qs(urlsplit(address).query)
    assert query["ds"] == ["remote-file"]
    (source,) = query["ds.url"]
    # Viewers split at commas, and tell the kind of a file by its ending.
    assert "," not in source
    assert source.endswith(".mcap")
    assert unquote(urlsplit(source).path) == "/" + log.name
    assert ask(source)[2] == log.read_bytes()
    (layout,) = query["layoutUrl"]
    assert json.loads(ask(layout)[2])["playbackConfig"]["speed"] == server.speed
    live = parse_qs(urlsplit(server.viewer_address("ws://127.0.0.1:8765")).query)
    assert live["ds"] == ["foxglove-websocket"]
    assert live["ds.url"] == ["ws://127.0.0.1:8765"]
    assert live["layoutUrl"] == [layout]


def test_foxglove_gets_no_layout_in_its_address(log):
    served = FileServer(log, viewer="foxglove", port=0)
    try:
        query = parse_qs(urlsplit(served.viewer_address()).query)
        assert set(query) == {"ds", "ds.url"}
        assert served.layout_address is not None
        assert ask(served.log_address, Origin="https://app.foxglove.dev")[0] == 200
    finally:
        served.close()


def test_a_log_without_layouts_gets_those_that_fit_and_a_speed_is_taken_over(tmp_path):
    path = write(tmp_path / "a.mcap", layouts=False)
    served = FileServer(path, layout="positioning-error", speed=0.25, port=0)
    try:
        assert served.layouts == ["positioning-error", "overview"]
        assert served.layout_address.endswith("/layout-positioning-error.json")
        assert json.loads(ask(served.layout_address)[2])["playbackConfig"] == {"speed": 0.25}
    finally:
        served.close()


def test_a_log_that_is_written_anew_stays_what_it_was(tmp_path):
    path = write(tmp_path / "a.mcap")
    before = path.read_bytes()
    served = FileServer(path, port=0)
    try:
        with LogWriter(path, metadata={}) as log:
            log.write("state", Table(np.arange(5.0), {"x": Column(np.zeros(5), "m")}))
        assert path.read_bytes() != before
        assert ask(served.log_address)[2] == before
    finally:
        served.close()


def test_viewers_that_hang_up_leave_no_trace(server, capfd):
    parts = urlsplit(server.log_address)
    for _ in range(5):
        connection = socket.create_connection((parts.hostname, parts.port))
        connection.sendall(f"GET {parts.path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        connection.recv(100)
        # Closed with a reset, as a browser does that has seen enough.
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        connection.close()
    assert ask(server.log_address)[0] == 200
    assert capfd.readouterr().err == ""


def test_several_viewers_are_served_at_once(server, log):
    whole = log.read_bytes()
    found: list[bool] = []

    def read(k: int) -> None:
        body = ask(server.log_address, Range=f"bytes={1000 * k}-{1000 * k + 4999}")[2]
        found.append(body == whole[1000 * k : 1000 * k + 5000])

    threads = [threading.Thread(target=read, args=(k,)) for k in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10)
    assert found == [True] * 20


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"viewer": "lichtblick.example"}, "--viewer: found lichtblick.example, expected lichtblick"),
        ({"viewer": "http://a:99999"}, "--viewer: found"),
        ({"viewer": "file:///tmp/x"}, "--viewer: found"),
        ({"layout": "nice"}, "--layout: found nice, .* has: overview"),
        ({"speed": 20.0}, "--speed: found 20, viewers play a file at 0.01 to 5"),
    ],
)
def test_wrong_options_are_told(log, options, text):
    with pytest.raises(InputError, match=text):
        FileServer(log, port=0, **options)


def hdsim(*arguments: object, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "hdsim.cli", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
        # Jobs in the background are born deaf to Ctrl-C, and so would be their children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def test_the_command_prints_and_opens_the_viewers_address_and_ends_on_interrupt(log, tmp_path):
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {tmp_path}/opened\n')
    browser.chmod(0o755)
    process = hdsim("replay", log, "--open", "--viewer", VIEWER, "--port", 0, BROWSER=f"{browser} %s")
    lines = dict(process.stdout.readline().split(maxsplit=1) for _ in range(3))
    address = lines["viewer"].strip()
    query = parse_qs(urlsplit(address).query)
    assert lines["log"].startswith(query["ds.url"][0])
    assert lines["layout"].startswith("overview")
    assert ask(query["ds.url"][0])[2] == log.read_bytes()
    assert ask(query["layoutUrl"][0])[0] == 200
    assert ask(query["ds.url"][0], Origin="https://else.example")[0] == 403
    # A second one at the same port is refused in one line.
    second = hdsim("replay", log, "--port", urlsplit(query["ds.url"][0]).port)
    _, complaint = second.communicate(timeout=30)
    assert second.returncode == 2
    assert len(complaint.splitlines()) == 1
    assert "the port is taken; --port takes another" in complaint
    process.send_signal(signal.SIGINT)
    _, complaint = process.communicate(timeout=20)
    assert process.returncode == 130
    assert [line for line in complaint.splitlines() if line] == [
        "a page of https://else.example was refused; --viewer names the viewer's address",
        "interrupted",
    ]
    assert (tmp_path / "opened").read_text() == address
