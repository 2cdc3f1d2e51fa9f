"""What layouts have to know of a run besides what is in its log: how fast it turns, its limits, its point."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from hdsim.errors import InputError
from hdsim.log.naming import RUN_TABLES, Array

RECORD = "hdsim.replay"
KEY = "replay"
"""Entry of a run's metadata: JSON of the fields of `Facts` that are known before it begins."""

SPEEDS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Playback speeds that viewers offer."""
_SHORT_S, _LONG_S = 10.0, 60.0
_MOST_TURNS_PER_S = 4.0
"""Of the ellipse as it is played back: at 30 frames a second it looks reversed from 7.5 a second on."""
_SPEED_WINDOW_S = 2e-3
"""Time over which a motor's speed is taken: longer than a sensor's noise, shorter than a move."""


@dataclass(frozen=True)
class Facts:
    """What a layout is fitted to.

    Args:
        motor_speed_rad_per_s: the highest speed of the motor, over two milliseconds or a sample; 0: at rest.
        teeth_rate_hz: how often the teeth's forces are sampled; 0: once at most, or never.
        lowest_force_n: of a tooth, signed by its flank.
        highest_force_n: the other end.
        lowest_output_torque_nm: of the drive on the output.
        highest_output_torque_nm: the other end.
        lowest_motor_torque_nm: of the motor.
        highest_motor_torque_nm: the other end.
        rated_torque_nm: of the drive; 0: unknown.
        torque_limit_nm: of the motor; 0: none.
        verdict: what a diagnosis found, in a few words; none: "".
    """

    motor_speed_rad_per_s: float = 0.0
    teeth_rate_hz: float = 0.0
    lowest_force_n: float = 0.0
    highest_force_n: float = 0.0
    lowest_output_torque_nm: float = 0.0
    highest_output_torque_nm: float = 0.0
    lowest_motor_torque_nm: float = 0.0
    highest_motor_torque_nm: float = 0.0
    rated_torque_nm: float = 0.0
    torque_limit_nm: float = 0.0
    verdict: str = ""

    @classmethod
    def read(cls, values: Mapping[str, Any]) -> Facts:
        """From JSON values by name; what is not there has its default.

        Raises:
            InputError: a value of another kind.
        """
        try:
            kinds = {name: type(value) for name, value in asdict(cls()).items()}
            return cls(**{name: kind(values[name]) for name, kind in kinds.items() if name in values})
        except (TypeError, ValueError) as error:
            raise InputError(f"the log's record {RECORD} is damaged: {error}") from None

    @classmethod
    def of_metadata(cls, metadata: Mapping[str, str]) -> Facts:
        """What a run's metadata say under ``replay``, before it begins."""
        try:
            values = json.loads(metadata.get(KEY, "{}"))
        except ValueError as error:
            raise InputError(f"the metadata's {KEY} is no JSON: {error}") from None
        return cls.read(values if isinstance(values, dict) else {})

    @property
    def record(self) -> dict[str, str]:
        """As a metadata record."""
        return {name: str(value) for name, value in asdict(self).items()}

    @property
    def largest_force_n(self) -> float:
        """Of a tooth in the run, on either flank; 0: none."""
        return max(self.highest_force_n, -self.lowest_force_n)

    @property
    def teeth_follow_the_mesh(self) -> bool:
        """Whether the force of one tooth over time is sampled often enough: a tooth meshes twice a turn."""
        return self.teeth_rate_hz * 2 * np.pi >= 2 * 10 * self.motor_speed_rad_per_s


def playback_speed(duration: float, motor_speed: float = 0.0) -> float:
    """Speed at which a run is pleasant to watch: 10 s to a minute where viewers can.

    Viewers play at 0.01 to 5 times real time. A wave generator that is seen may turn at most four times a
    second, or it seems to turn at another speed, as any wheel does in any film.

    Args:
        duration: length of the run, s.
        motor_speed: highest speed of a motor that is seen, rad/s; 0: nothing is seen to turn.
    """
    if duration <= 0:
        chosen = 1.0
    elif duration < _SHORT_S:
        chosen = max((s for s in SPEEDS if duration / s >= _SHORT_S), default=SPEEDS[0])
    else:
        chosen = min((s for s in SPEEDS if s >= 1 and duration / s <= _LONG_S), default=SPEEDS[-1])
    if motor_speed <= 0:
        return chosen
    most = _MOST_TURNS_PER_S * 2 * np.pi / motor_speed * (1 + 1e-9)
    return min(chosen, max((s for s in SPEEDS if s <= most), default=SPEEDS[0]))


class FactsCollector:
    """Finds a run's `Facts` while its tables are written.

    Args:
        metadata: of the run.
    """

    def __init__(self, metadata: Mapping[str, str]) -> None:
        self._known = Facts.of_metadata(metadata)
        self._last: tuple[float, float] | None = None
        self._window = -np.inf
        self._fastest = 0.0
        self._ends: dict[str, float] = {}
        self._teeth_times: list[float] = []

    def feed(self, table: str, time: Array, columns: Mapping[str, Array]) -> None:
        """Take the next rows of a table; columns (n,) or (n, k)."""
        if not len(time):
            return
        if table in RUN_TABLES and "motor_angle" in columns and columns["motor_angle"].ndim == 1:
            self._motor(time, columns["motor_angle"])
        if table == "teeth":
            self._teeth_times = [*self._teeth_times, *time[:2].tolist()][:2]
            self._range("force_n", columns.get("normal_force"))
        if table in RUN_TABLES:
            self._range("output_torque_nm", columns.get("output_torque"))
            self._range("motor_torque_nm", columns.get("motor_torque"))

    def _range(self, quantity: str, values: Array | None) -> None:
        if values is not None and np.isfinite(values).any():
            for end, found in (("lowest", np.fmin), ("highest", np.fmax)):
                name = f"{end}_{quantity}"
                self._ends[name] = float(found(self._ends.get(name, 0.0), found.reduce(values, axis=None)))

    def _motor(self, time: Array, angle: Array) -> None:
        good = np.isfinite(angle)
        time, angle = time[good], angle[good]
        if not len(time):
            return
        window = np.floor(time / _SPEED_WINDOW_S)
        # The first sample of each window, however the run is cut into blocks.
        first = np.diff(window, prepend=self._window) != 0
        self._window = float(window[-1])
        time, angle = time[first], angle[first]
        if not len(time):
            return
        if self._last is not None:
            time, angle = np.append(self._last[0], time), np.append(self._last[1], angle)
        if len(time) > 1:
            speed = np.abs(np.diff(angle)) / np.diff(time)
            self._fastest = max(self._fastest, float(speed.max()))
        self._last = (float(time[-1]), float(angle[-1]))

    def facts(self) -> Facts:
        """What is known so far."""
        apart = self._teeth_times[-1] - self._teeth_times[0] if self._teeth_times else 0.0
        found = replace(
            self._known,
            motor_speed_rad_per_s=self._fastest,
            teeth_rate_hz=1.0 / apart if apart > 0 else 0.0,
        )
        ends: dict[str, Any] = {**self._ends}
        return replace(found, **ends)
