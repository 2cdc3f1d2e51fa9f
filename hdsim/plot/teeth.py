"""The panels of the tooth load: one moment over all angles, and the whole run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdsim.plot import style, units
from hdsim.plot.curves import is_nothing
from hdsim.plot.panels import Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

    from hdsim.recording import Recording

Array = NDArray[np.float64]

#: Force below which a tooth is drawn as unloaded, N.
NEGLIGIBLE_N = 1e-6

#: Cells of the map of tooth loads.
MAP_ANGLES = 120
MAP_TIMES = 400


def tooth_panels(recording: Recording) -> list[Panel]:
    """Load of the teeth: all angles at the moment of largest load, and over the whole run."""
    table = recording.tables.get("teeth")
    if table is None or "normal_force" not in table or "angle" not in table or len(table) == 0:
        return []
    force, angle = table["normal_force"], np.degrees(table["angle"])
    if is_nothing(force):
        return []
    time = table.time
    peak = int(np.argmax(np.abs(force).sum(axis=1)))
    clock = units.for_duration(float(recording.time[-1]))

    def profile(axes: Axes) -> None:
        order = np.argsort(angle[peak])
        loaded = order[np.abs(force[peak, order]) > NEGLIGIBLE_N]
        axes.vlines(angle[peak, loaded], 0.0, force[peak, loaded], color=style.BLUE, linewidth=1.2)
        axes.plot(angle[peak, order], force[peak, order], ".", color=style.BLUE, markersize=2.5)
        _angle_axis(axes.xaxis)
        axes.set_xlim(-180, 180)
        axes.set_xlabel("angle from wave generator's major axis (deg)")
        axes.set_ylabel("normal force (N)")

    def history(axes: Axes) -> None:
        edges, cells = force_map(time, force, angle)
        size = float(np.max(np.abs(cells)))
        drawn = axes.pcolormesh(
            clock.factor * edges,
            np.linspace(-180.0, 180.0, cells.shape[0] + 1),
            cells,
            cmap=style.DIVERGING,
            vmin=-size,
            vmax=size,
            rasterized=True,
        )
        axes.grid(False)
        _angle_axis(axes.yaxis)
        axes.set_ylabel("angle from\nmajor axis (deg)")
        axes.set_xlabel(f"time ({clock.name})")
        axes.figure.colorbar(drawn, ax=axes, label="normal force (N)", pad=0.01, fraction=0.06)

    count = int(np.sum(np.abs(force[peak]) > NEGLIGIBLE_N))
    when = f"{clock.factor * time[peak]:.3g} {clock.name}"
    panels = [Panel(f"Largest tooth load, {when}: {count} of {force.shape[1]} teeth", profile)]
    if len(time) >= 10:
        panels.append(Panel("Tooth load over time (colour: flank)", history))
    return panels


def force_map(time: Array, force: Array, angle: Array) -> tuple[Array, Array]:
    """Force of largest size in cells of time and angle.

    Args:
        time: shape (n,), s.
        force: shape (n, teeth), N.
        angle: shape (n, teeth), deg, -180 to 180.

    Returns:
        Edges of the cells in time, shape (m + 1,), and cells, shape (``MAP_ANGLES``, m), N; m is at most
        ``MAP_TIMES``. A cell without a tooth takes the mean of its neighbours in angle.
    """
    columns = min(len(time), MAP_TIMES)
    spacing = (time[-1] - time[0]) / max(len(time) - 1, 1)
    edges = np.linspace(time[0] - spacing / 2, time[-1] + spacing / 2, columns + 1)
    column = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, columns - 1)
    row = np.clip(((angle + 180.0) / 360.0 * MAP_ANGLES).astype(int), 0, MAP_ANGLES - 1)
    cell = row * columns + column[:, None]
    highest = np.full(MAP_ANGLES * columns, -np.inf)
    lowest = np.full(MAP_ANGLES * columns, np.inf)
    np.maximum.at(highest, cell.ravel(), force.ravel())
    np.minimum.at(lowest, cell.ravel(), force.ravel())
    cells = np.where(highest >= -lowest, highest, lowest)
    cells[~np.isfinite(highest)] = np.nan
    cells = cells.reshape(MAP_ANGLES, columns)
    neighbours = 0.5 * (np.roll(cells, 1, axis=0) + np.roll(cells, -1, axis=0))
    return edges, np.where(np.isnan(cells), neighbours, cells)


def _angle_axis(axis: Axis) -> None:
    axis.set_ticks([-180, -90, 0, 90, 180])
