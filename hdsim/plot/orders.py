"""The panel of the transmission error's orders: what repeats with every turn of the wave generator."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hdsim.log.orders import order_spectrum
from hdsim.plot import style, units
from hdsim.plot.curves import is_nothing
from hdsim.plot.panels import Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hdsim.recording import Recording

#: Turns of the wave generator, in one direction, below which orders are not worth a panel.
TURNS = 10

#: Orders that are drawn.
HIGHEST_ORDER = 10


def order_panel(recording: Recording) -> Panel | None:
    """Amplitude of the transmission error over its order, for runs that turn one way long enough."""
    if any(name not in recording for name in ("motor_angle", "transmission_error")):
        return None
    angle, error = recording["motor_angle"], recording["transmission_error"]
    turning = np.diff(angle)
    if not (np.all(turning > 0) or np.all(turning < 0)) or is_nothing(error):
        return None
    turns = abs(angle[-1] - angle[0]) / (2 * math.pi)
    if turns < TURNS or len(angle) < 4 * HIGHEST_ORDER * turns:
        return None

    def draw(axes: Axes) -> None:
        orders, amplitudes = order_spectrum(angle, error)
        some = (orders > 0) & (orders <= HIGHEST_ORDER)
        unit = units.for_error(units.largest(amplitudes[some]))
        axes.plot(orders[some], unit.factor * amplitudes[some], color=style.BLUE)
        axes.set_xlim(0, HIGHEST_ORDER)
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("order: cycles per turn of the wave generator")
        axes.set_ylabel(f"amplitude ({unit.name})")

    return Panel("Orders of the transmission error", draw)
