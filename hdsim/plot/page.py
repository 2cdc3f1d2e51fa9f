"""One page that shows a run: motion, errors, torques, tooth load and torsion."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from hdsim.errors import InputError
from hdsim.plot import origin, style, units
from hdsim.plot.orders import order_panel
from hdsim.plot.panels import Panel, time_panels, torsion_panel
from hdsim.plot.teeth import tooth_panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.recording import Recording

#: Width and height in inches of a row of panels.
STRIP = (11.0, 2.6)
#: Panels over time up to which they stand in one column.
_ONE_COLUMN = 3


def plot_recording(recording: Recording, *, size_in: tuple[float, float] = style.PAGE) -> Figure:
    """Draw a run on one page.

    Panels whose channels are missing or zero throughout are left out. Long runs are thinned so that
    the extremes stay visible.

    Args:
        recording: a simulated, measured or replayed run.
        size_in: width and height in inches.

    Returns:
        A figure, ready for ``savefig``; no window is opened.

    Raises:
        InputError: the recording has no samples, or nothing in it can be drawn.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    if "state" not in recording.tables or len(recording.state) == 0:
        raise InputError("the recording has no samples in its table 'state': nothing to draw")
    timed = time_panels(recording)
    single = (torsion_panel(recording), order_panel(recording))
    others = [*tooth_panels(recording), *(panel for panel in single if panel is not None)]
    if not timed and not others:
        raise InputError(f"nothing to draw in channels that are unknown or zero: {', '.join(recording)}")
    with rc_context(style.STYLE):
        figure = Figure(figsize=size_in, dpi=style.DPI)
        _write(figure, recording)
        for axes, panel in _arrange(figure, recording, timed, others):
            panel.draw(axes)
            axes.set_title(panel.title)
    return figure


def plot_strip(recording: Recording, *, panels: int = 3, size_in: tuple[float, float] = STRIP) -> Figure:
    """Draw the first panels of a run over time side by side, without title and footer.

    Args:
        recording: a simulated, measured or replayed run.
        panels: how many at most.
        size_in: width and height in inches; of fewer panels the width is less.

    Raises:
        InputError: nothing in it can be drawn.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    chosen = time_panels(recording)[:panels] if len(recording.time) else []
    if not chosen:
        raise InputError("nothing to draw over time")
    clock = units.for_duration(float(recording.time[-1]))
    with rc_context(style.STYLE):
        width, height = size_in
        size = (width * max(len(chosen) / panels, 0.5), height)
        figure = Figure(figsize=size, dpi=style.DPI, layout="constrained")
        for axes, panel in zip(figure.subplots(1, len(chosen), squeeze=False)[0], chosen, strict=True):
            panel.draw(axes)
            axes.set_title(panel.title)
            axes.set_xlabel(f"time ({clock.name})")
            legend = axes.get_legend()
            if legend is not None:
                # Beside the title there is no room in a narrow panel.
                axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.26), ncols=3)
    return figure


def _write(figure: Figure, recording: Recording) -> None:
    """Title, subtitle and footer, with room kept for them above and below the panels."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    width, height = figure.get_size_inches()
    characters = int(width * 15)
    about = _wrapped(origin.subtitle(recording), characters)
    foot = _wrapped(origin.footer(recording), int(width * 17))
    trouble = textwrap.shorten(origin.trouble(recording), characters, placeholder=" ...")
    left, y = 0.12 / width, 1.0 - 0.08 / height
    figure.text(left, y, origin.title(recording), fontsize=14, fontweight="bold", va="top")
    y -= 0.28 / height
    if about:
        figure.text(left, y, about, fontsize=9, color=style.BLACK, va="top", linespacing=1.3)
        y -= 0.17 * (about.count("\n") + 1) / height
    if trouble:
        figure.text(left, y, trouble, fontsize=9, color=style.ORANGE, fontweight="bold", va="top")
        y -= 0.17 / height
    y -= 0.04 / height
    bottom = 0.0
    if foot:
        figure.text(left, 0.06 / height, foot, fontsize=7.5, color=style.GREY, va="bottom")
        bottom = (0.08 + 0.13 * (foot.count("\n") + 1)) / height
    figure.set_layout_engine(
        ConstrainedLayoutEngine(rect=(0.0, bottom, 1.0, y - bottom), w_pad=0.09, h_pad=0.05)
    )


def _wrapped(text: str, width: int) -> str:
    return "\n".join(textwrap.fill(line, width) for line in text.split("\n"))


def _arrange(
    figure: Figure, recording: Recording, timed: list[Panel], others: list[Panel]
) -> list[tuple[Axes, Panel]]:
    """Axes for every panel: those over time on the left, over one time axis, the others on the right."""
    found: list[tuple[Axes, Panel]] = []
    if timed and others:
        halves = figure.add_gridspec(1, 2, width_ratios=[1, 1] if len(timed) <= _ONE_COLUMN else [2, 1])
        left, right = halves[0], halves[1]
    else:
        left = right = figure.add_gridspec(1, 1)[0]
    if timed:
        columns = 1 if len(timed) <= _ONE_COLUMN else 2
        # An odd one out would leave a hole: the first panel takes the width of two.
        wide = columns == 2 and len(timed) % 2 == 1
        rows = (len(timed) + wide) // columns if columns == 2 else len(timed)
        grid = left.subgridspec(rows, columns)
        clock = units.for_duration(float(recording.time[-1]))
        first: Axes | None = None
        for k, panel in enumerate(timed):
            place = k + 1 if wide and k else k
            row, column = divmod(place, columns)
            axes = figure.add_subplot(grid[0, :] if wide and k == 0 else grid[row, column], sharex=first)
            first = first or axes
            if row == rows - 1:
                axes.set_xlabel(f"time ({clock.name})")
            else:
                axes.tick_params(labelbottom=False)
            found.append((axes, panel))
    if others:
        inner = right.subgridspec(len(others), 1)
        found += [(figure.add_subplot(inner[k, 0]), panel) for k, panel in enumerate(others)]
    return found
