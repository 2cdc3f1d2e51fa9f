"""A viewer of nothing but the websockets package: subprotocol foxglove.sdk.v1, as its specification says."""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable
from typing import Any


class Client:
    """Subscribes to every topic; keeps what arrives."""

    def __init__(self, address: str) -> None:
        import inspect

        from websockets.sync.client import connect

        # Newer versions want it said that the connection is closed by hand.
        by_hand = {"legacy": True} if "legacy" in inspect.signature(connect).parameters else {}
        self.socket = connect(
            address, subprotocols=["foxglove.sdk.v1"], max_size=None, close_timeout=0.5, **by_hand
        )
        self.info: dict[str, Any] = {}
        self.channels: dict[int, dict[str, Any]] = {}
        self.messages: dict[str, list[tuple[int, bytes]]] = {}
        self.parameters: dict[str, Any] = {}
        self.playback: list[tuple[int, int, float, bool, str]] = []
        self.status: list[str] = []
        self.clock = 0
        self.clocks = 0
        self.after_seek: set[str] = set()
        """Topics that have come since time went back."""

    def take(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Receive for a while, or until something is so; returns whether it became so."""
        deadline = time.monotonic() + seconds
        while not until() and (left := deadline - time.monotonic()) > 0:
            try:
                self._take_one(self.socket.recv(timeout=min(left, 0.1)))
            except TimeoutError:
                continue
        return until()

    def _take_one(self, data: str | bytes) -> None:
        if isinstance(data, str):
            message = json.loads(data)
            match message["op"]:
                case "serverInfo":
                    self.info = message
                case "advertise":
                    for channel in message["channels"]:
                        self.channels[channel["id"]] = channel
                    wanted = [{"id": c["id"], "channelId": c["id"]} for c in message["channels"]]
                    self.send({"op": "subscribe", "subscriptions": wanted})
                case "parameterValues":
                    self.parameters |= {p["name"]: p.get("value") for p in message["parameters"]}
                case "status" if message["message"].startswith("Unknown channel ID"):
                    # The SDK offers a new channel a moment before it takes subscriptions to it.
                    id = int(message["message"].rsplit(" ", 1)[1])
                    self.send({"op": "subscribe", "subscriptions": [{"id": id, "channelId": id}]})
                case "status":
                    self.status.append(message["message"])
            return
        if data[0] == 1:
            id, at = struct.unpack_from("<IQ", data, 1)
            self.messages.setdefault(self.channels[id]["topic"], []).append((at, data[13:]))
            self.after_seek.add(self.channels[id]["topic"])
        elif data[0] == 2:
            before = self.clock
            self.clocks += 1
            (self.clock,) = struct.unpack_from("<Q", data, 1)
            if self.clock < before:
                self.after_seek = set()
        elif data[0] == 5:
            state, at, speed, jumped, size = struct.unpack_from("<BQfBI", data, 1)
            self.playback.append((state, at, speed, bool(jumped), data[19 : 19 + size].decode()))

    def send(self, message: dict[str, Any]) -> None:
        self.socket.send(json.dumps(message))

    def set(self, **values: Any) -> None:
        parameters = [{"name": name.replace("__", "."), "value": value} for name, value in values.items()]
        self.send({"op": "setParameters", "parameters": parameters, "id": "set"})

    def control(self, *, pause: bool, speed: float, seek: int | None = None, id: str = "r") -> None:
        """A playback control request."""
        body = struct.pack("<BBfBQI", 3, int(pause), speed, seek is not None, seek or 0, len(id))
        self.socket.send(body + id.encode())

    def times(self, topic: str) -> list[int]:
        return [at for at, _ in self.messages.get(topic, [])]
