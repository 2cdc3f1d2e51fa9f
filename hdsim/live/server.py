"""The websocket server of the Foxglove SDK around a player, with its parameters and playback controls."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

from hdsim.errors import HdsimError, InputError
from hdsim.log import naming

if TYPE_CHECKING:
    from hdsim.live.parameters import LiveParameters
    from hdsim.live.player import Playback, Player
    from hdsim.live.store import MessageStore

DEFAULT_PORT = 8765
_HINT = "live viewing needs the package foxglove-sdk: pip install 'hdsim[live]'"

HEARTBEAT_S = 0.2
"""Time between two messages of a time that stands still, s of the wall clock."""

CONTROLS = ("paused", "speed", "seek_s")
"""Parameters for viewers without playback controls: stop, multiple of real time, run time to go to (s)."""


class LiveServer:
    """Serves a player to any number of viewers (subprotocol ``foxglove.sdk.v1``).

    The SDK keeps a queue of 1,024 messages for each viewer and drops the oldest, so that nobody waits for a
    slow one. A viewer that leaves while playback is paused, and was the last, lets it go on.

    Args:
        player: what is shown.
        store: for the topics' schemas.
        name: of the session.
        host: address to listen at.
        port: 0 for any that is free.
        parameters: numbers that viewers may change.
        wait: let playback begin only when the first viewer has come.

    Raises:
        InputError: the SDK is not installed, or the port is taken.
    """

    def __init__(
        self,
        player: Player,
        store: MessageStore,
        *,
        name: str,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        parameters: LiveParameters | None = None,
        wait: bool = False,
    ) -> None:
        try:
            import foxglove
            from foxglove.websocket import Capability
        except ImportError:
            raise InputError(_HINT) from None
        self._foxglove = foxglove
        self._player, self._store, self._parameters = player, store, parameters
        self._context = foxglove.Context()
        self._channels: dict[str, Any] = {}
        self._viewers: dict[int, set[int]] = {}
        self._lock = threading.Lock()
        self._told: tuple[Any, ...] = ()
        self._shown: tuple[Any, ...] = ()
        self._fresh = False
        self._time_told = (0, 0.0)
        try:
            self._server = foxglove.start_server(
                name=name,
                host=host,
                port=port,
                context=self._context,
                capabilities=[Capability.Time, Capability.Parameters],
                playback_time_range=(player.start_time, player.end_time),
                server_listener=cast(Any, self),
            )
        except (RuntimeError, OSError, ValueError) as error:
            raise InputError(f"cannot listen at {host}:{port}: {error}") from None
        self.address = f"ws://{host}:{self._server.port}"
        self._waits = wait
        if wait:
            player.pause()
        player.viewer = self

    @property
    def viewers(self) -> int:
        """Number of viewers that are subscribed to something."""
        with self._lock:
            return len(self._viewers)

    def stop(self) -> None:
        """Close all connections."""
        self._player.viewer = None
        self._server.stop()

    # What the player delivers.

    def advertise(self) -> None:
        """Offer all topics of the store at once."""
        for topic in self._store.topics:
            self._channel(topic)

    def wants(self, topic: str) -> bool:
        """Whether anybody is subscribed; the topic is offered if it was not yet."""
        return bool(self._channel(topic).has_sinks())

    def publish(self, topic: str, log_time: int, body: bytes) -> None:
        """Send a message to whoever is subscribed."""
        self._channel(topic).log(body, log_time=log_time)

    def _channel(self, topic: str) -> Any:
        channel = self._channels.get(topic)
        if channel is None:
            about = self._store.topics[topic]
            schema = about.schema
            channel = self._foxglove.Channel(
                topic,
                schema=self._foxglove.Schema(name=schema.name, encoding=schema.encoding, data=schema.data),
                message_encoding=about.channel.message_encoding,
                metadata=dict(about.channel.metadata),
                context=self._context,
            )
            self._channels[topic] = channel
        return channel

    def tell(self, state: Playback) -> None:
        """Publish time; playback state and parameters where they have changed, or for a new viewer.

        The protocol wants the state after a change or a request only, and viewers that do not know it
        complain about each.
        """
        now = time.monotonic()
        if state.time != self._time_told[0] or state.jumped or now - self._time_told[1] > HEARTBEAT_S:
            self._server.broadcast_time(state.time)
            self._time_told = state.time, now
        with self._lock:
            fresh, self._fresh = self._fresh, False
        shown = (self._status(state), state.speed)
        if fresh or state.jumped or shown != self._shown:
            self._shown = shown
            self._server.broadcast_playback_state(self._playback(state, None))
        values = (state.paused, state.speed, *(self._parameters.values.values() if self._parameters else ()))
        refused = self._parameters.refusals() if self._parameters is not None else []
        if values != self._told or refused:
            self._told = values
            self._server.publish_parameter_values(self._all_parameters())
        for text in refused:
            self._say(text)

    def _status(self, state: Playback) -> Any:
        from foxglove.websocket import PlaybackStatus

        if state.ended:
            return PlaybackStatus.Ended
        if state.paused:
            return PlaybackStatus.Paused
        return PlaybackStatus.Buffering if state.waiting else PlaybackStatus.Playing

    def _playback(self, state: Playback, request: str | None) -> Any:
        from foxglove.websocket import PlaybackState

        return PlaybackState(self._status(state), state.time, state.speed, state.jumped, request or "")

    def _say(self, text: str) -> None:
        self._server.publish_status(text, self._foxglove.StatusLevel.Warning)

    def _all_parameters(self) -> list[Any]:
        state = self._player.state
        values: dict[str, Any] = {
            "paused": state.paused,
            "speed": float(state.speed),
            "seek_s": 1e-9 * (state.time - naming.EPOCH_NS),
        }
        if self._parameters is not None:
            values |= self._parameters.values
        return [self._foxglove.Parameter(name, value=value) for name, value in values.items()]

    # What viewers do; the SDK calls these from its own threads.

    def on_subscribe(self, client: Any, channel: Any) -> None:
        """A viewer wants a topic: it gets the latest message at once."""
        with self._lock:
            self._fresh = self._fresh or client.id not in self._viewers
            self._viewers.setdefault(client.id, set()).add(channel.id)
            waited, self._waits = self._waits, False
        if waited:
            self._player.pause(False)
        self._player.refresh(channel.topic)

    def on_unsubscribe(self, client: Any, channel: Any) -> None:
        """A viewer has left a topic, or altogether."""
        with self._lock:
            wanted = self._viewers.get(client.id, set())
            wanted.discard(channel.id)
            if not wanted:
                self._viewers.pop(client.id, None)
            nobody = not self._viewers
        if nobody:
            self._player.pause(False)

    def on_get_parameters(
        self, client: Any, param_names: list[str], request_id: str | None = None
    ) -> list[Any]:
        """The parameters of those names, all when none are named."""
        return [p for p in self._all_parameters() if not param_names or p.name in param_names]

    def on_set_parameters(
        self, client: Any, parameters: list[Any], request_id: str | None = None
    ) -> list[Any]:
        """Take over what a viewer has set; what cannot be is told to it, with the values that hold."""
        for parameter in parameters:
            try:
                self._set(parameter.name, parameter.get_value())
            except HdsimError as error:
                self._say(str(error).splitlines()[0])
        return self._all_parameters()

    def _set(self, name: str, value: Any) -> None:
        if name == "paused":
            if not isinstance(value, bool):
                raise InputError(f"paused: found {value!r}, expected true or false")
            self._player.pause(value)
        elif name == "speed":
            if not _number(name, value) > 0:
                raise InputError(f"speed: found {value}, expected a number greater than 0")
            self._player.set_speed(float(value))
        elif name == "seek_s":
            self._player.seek(naming.EPOCH_NS + round(1e9 * _number(name, value)))
        elif self._parameters is None:
            raise InputError(f"{name} cannot be changed; there are: {', '.join(CONTROLS)}")
        else:
            self._parameters.request(name, _number(name, value))

    def on_parameters_subscribe(self, param_names: list[str]) -> None:
        """Nothing to do: the SDK keeps the list."""

    def on_parameters_unsubscribe(self, param_names: list[str]) -> None:
        """Nothing to do: the SDK keeps the list."""

    def on_playback_control_request(self, playback_control_request: Any) -> Any:
        """Play, pause, speed and seek of a viewer's own controls."""
        from foxglove.websocket import PlaybackCommand

        request = playback_control_request
        if request.playback_speed > 0:
            self._player.set_speed(request.playback_speed)
        if request.seek_time is not None:
            self._player.seek(request.seek_time)
        self._player.pause(request.playback_command == PlaybackCommand.Pause)
        state = replace(self._player.state, jumped=request.seek_time is not None)
        return self._playback(state, request.request_id)


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{name}: found {value!r}, expected a number")
    return float(value)
