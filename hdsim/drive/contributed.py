"""What parts hand to a model: kernels with their numbers, states, signals, springs, sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.kernel import OWN, SIGNAL_VALUES, Kernel

if TYPE_CHECKING:
    from hdsim.parts import InputFriction, OddTooth, State

Array = NDArray[np.float64]


@dataclass
class Contributions:
    """What the parts have handed in during one pass.

    Elements are kernel, numbers, first own state, whether they run last, and account of heat.
    """

    elements: list[tuple[Kernel, Array, int, bool, int]] = field(default_factory=list)
    twists: list[tuple[Kernel, Array]] = field(default_factory=list)
    signals: list[Any] = field(default_factory=list)
    states: list[State] = field(default_factory=list)
    wind_ups: list[Callable[[Array], Array]] = field(default_factory=list)
    sensors: dict[str, list[Any]] = field(default_factory=dict)
    heat_accounts: list[str] = field(default_factory=list)
    input_frictions: list[InputFriction] = field(default_factory=list)
    external: dict[str, int] = field(default_factory=dict)
    housing: tuple[int, float] | None = None
    half_gap_rad: float = 0.0
    gap_waves: list[float] = field(default_factory=list)
    gap_growth: float = 0.0
    film_share: float = 0.0
    odd_teeth: list[OddTooth] = field(default_factory=list)
    play: bool = False


class Contributed:
    """The calls of ``hdsim.parts.Builder`` that collect what parts contribute."""

    def __init__(self) -> None:
        self._given = Contributions()
        self._offered: dict[str, Any] = {}
        # Known after a first pass over the parts: the number of their states, and their names.
        self._own_before = 0
        self._names: dict[str, int] = {}
        self.input_frictions: Sequence[InputFriction] = ()
        self.twist_sign = 1.0

    def element(
        self,
        kernel: Kernel,
        parameters: Sequence[float] | Array,
        *,
        states: Sequence[State] = (),
        last: bool = False,
        heat: str = "",
    ) -> int:
        """Add an element; see ``hdsim.parts.Builder.element``."""
        first = OWN + len(self._given.states)
        self._given.states.extend(states)
        accounts = self._given.heat_accounts
        if not heat or heat not in accounts:
            accounts.append(heat or f"{kernel.__name__} {len(accounts) + 1}")
            account = len(accounts) - 1
        else:
            account = accounts.index(heat)
        numbers = np.asarray(parameters, dtype=np.float64)
        self._given.elements.append((kernel, numbers, first, last, account))
        return first

    def declare_input_friction(self, friction: InputFriction) -> None:
        """Tell the other parts of friction on the motor shaft."""
        self._given.input_frictions.append(friction)

    def housing(self, own: int, inertia_kg_m2: float) -> None:
        """Let the housing turn; see ``hdsim.parts.Builder.housing``."""
        if self._given.housing is not None:
            raise InputError("two parts of the model move the housing")
        self._given.housing = (own, inertia_kg_m2)

    def twist(self, kernel: Kernel, parameters: Sequence[float] | Array) -> None:
        """Add a contribution to the mesh twist."""
        self._given.twists.append((kernel, np.asarray(parameters, dtype=np.float64)))

    def series_compliance(self, wind_up: Callable[[Array], Array], *, play: bool = False) -> None:
        """Put a spring in series with the torsion spring."""
        self._given.wind_ups.append(wind_up)
        self._given.play |= play

    def widen_gap(self, half_gap_rad: float) -> None:
        """Add to the half-gap of the mesh (rad at the output); see ``hdsim.parts.Builder.widen_gap``."""
        self._given.half_gap_rad += half_gap_rad

    def wave_of_gap(self, amplitude_rad: float, by_motor: float, by_output: float, phase_rad: float) -> None:
        """Let the gap go round with the angles; see ``hdsim.parts.Builder.wave_of_gap``."""
        self._given.gap_waves += [amplitude_rad, by_motor, by_output, phase_rad]

    def fill_gap(self, share: float) -> None:
        """Let a share of the damper act in the gap, too; see ``hdsim.parts.Builder.fill_gap``."""
        self._given.film_share = max(self._given.film_share, share)

    def grow_gaps(self, growth: float) -> None:
        """Add to the growth of the gaps; see ``hdsim.parts.Builder.grow_gaps``."""
        self._given.gap_growth += growth

    def odd_tooth(self, tooth: OddTooth) -> None:
        """Let a tooth differ; see ``hdsim.parts.Builder.odd_tooth``."""
        self._given.odd_teeth.append(tooth)

    def signal(self, signal: Any) -> int:
        """Register a signal; returns the column of its value."""
        self._given.signals.append(signal)
        return OWN + self._own_before + SIGNAL_VALUES * (len(self._given.signals) - 1)

    def external(self, name: str) -> int | None:
        """Column of a signal that was offered; see ``hdsim.parts.Builder.external``."""
        if name not in self._offered:
            return None
        known = self._given.external
        if name not in known:
            known[name] = self.signal(self._offered[name])
        return known[name]

    def state_index(self, name: str) -> int | None:
        """Index in the inputs of a part's state, or None."""
        return self._names.get(name)

    def sensor(self, channel: str, sensor: Any) -> None:
        """Put a sensor between a channel and its reader."""
        self._given.sensors.setdefault(channel, []).append(sensor)
