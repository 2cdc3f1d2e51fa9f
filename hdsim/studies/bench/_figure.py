"""Figures of the bench procedures in the project's style."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from hdsim.plot import origin, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.recording import Recording

#: Colours for several curves of a kind, light to dark.
SHADES = ("#56B4E9", "#0072B2", "#003C5F", "#E69F00", "#D55E00", "#7A2E00")


@contextmanager
def page(title: str, subtitle: str, recording: Recording, height_in: float = 6.5) -> Iterator[Figure]:
    """A figure with title, subtitle and the footer of where the numbers come from.

    Args:
        title: what was tested.
        subtitle: how, and the result in words.
        recording: run whose provenance the footer states.
        height_in: height, inches.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    width = style.PAGE[0]
    settings: Any = style.STYLE
    with rc_context(settings):
        figure = Figure(figsize=(width, height_in), dpi=style.DPI, layout="constrained")
        lines = subtitle.count("\n") + 1
        left, y = 0.12 / width, 1.0 - 0.08 / height_in
        figure.text(left, y, title, fontsize=14, fontweight="bold", va="top")
        figure.text(
            left, y - 0.3 / height_in, subtitle, fontsize=9.5, color=style.BLACK, va="top", linespacing=1.35
        )
        figure.text(
            left, 0.06 / height_in, origin.footer(recording), fontsize=7.5, color=style.GREY, va="bottom"
        )
        top, bottom = (0.5 + 0.19 * lines) / height_in, 0.28 / height_in
        engine: Any = figure.get_layout_engine()
        engine.set(rect=(0.0, bottom, 1.0, 1.0 - top - bottom), w_pad=0.09, h_pad=0.06)
        yield figure


def zero_lines(axes: Axes, *, vertical: bool = True) -> None:
    """Thin lines through the origin."""
    axes.axhline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
    if vertical:
        axes.axvline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
