"""The energy audit of a run: the balance closes, and no friction gives energy back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from hdsim.recording import Table

Array = NDArray[np.float64]

#: Share of the exchanged energy that friction may seem to give back by rounding: 1e-16 of each power that
#: cancels in a sum of heats, times the few thousand steps after which a block is added up.
GIVEN_BACK = 1e-10


@dataclass
class Audit:
    """The energy balance of a run.

    Attributes:
        residual: largest |stored - start - supplied + delivered + heat|, J.
        exchanged: energy that went through the drive, J: the largest of the variations of work supplied,
            work delivered, heat, and of the stored energy.
        given_back: energy that friction and damping gave back to the drive, J: time integral of the negative
            heat of the part that has least (second law: none may have any).
        gave_back: name of the last account of heat that did so by more than rounding.
    """

    residual: float = 0.0
    given_back: float = 0.0
    gave_back: str = ""
    _first: dict[str, float] = field(default_factory=dict)
    _last: dict[str, float] = field(default_factory=dict)
    _moved: dict[str, float] = field(default_factory=dict)

    def add(self, table: Table, least_heat: Array, part: Array, parts: Sequence[str]) -> None:
        """Account for a block of the state table.

        Args:
            table: the block.
            least_heat: shape (n,), heat of the account that has least, where that is negative, else 0, W.
            part: shape (n,), index of that account.
            parts: names of the accounts.
        """
        self.residual = max(self.residual, float(np.max(np.abs(table["energy_residual"]), initial=0.0)))
        for name in ("work_supplied", "work_delivered", "heat", "potential_energy", "kinetic_energy"):
            values = np.concatenate([[self._last.get(name, table[name][0])], table[name]])
            self._moved[name] = self._moved.get(name, 0.0) + float(np.sum(np.abs(np.diff(values))))
            self._last[name] = float(values[-1])
        # Trapezoids between the samples, from the last one of the block before.
        time = np.concatenate([[self._last.get("time", table.time[0])], table.time])
        power = np.concatenate([[self._last.get("power", -least_heat[0])], -least_heat])
        back = 0.5 * (power[1:] + power[:-1]) * np.diff(time)
        self._last["time"], self._last["power"] = float(time[-1]), float(power[-1])
        self.given_back += float(np.sum(back))
        worst = int(np.argmax(-least_heat))
        if np.max(back, initial=0.0) > GIVEN_BACK * self.exchanged:
            self.gave_back = parts[int(part[worst])]

    @property
    def exchanged(self) -> float:
        """Energy that went through the drive, J."""
        return max(self._moved.values(), default=0.0)

    @property
    def relative(self) -> float:
        """Residual, or energy that friction gave back if that is more, over the exchanged energy."""
        return max(self.residual, self.given_back) / self.exchanged if self.exchanged > 0 else 0.0
