"""The look of every figure, in one place."""

from __future__ import annotations

from typing import Any

#: Colours that stay apart for colour-blind readers: Okabe and Ito, "Color Universal Design" (2008).
BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
BLACK = "#222222"
GREY = "#8A8A8A"

#: Blue for one flank, red for the other, white for no load; apart for colour-blind readers too.
DIVERGING = "RdBu_r"

#: Size in inches of a page, and its dots an inch: fits a laptop's screen.
PAGE = (13.0, 8.0)
DPI = 110

#: Matplotlib's settings while a figure is made.
STYLE: dict[Any, Any] = {
    "figure.dpi": DPI,
    "figure.facecolor": "white",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.edgecolor": "#666666",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "legend.borderaxespad": 0.2,
    "legend.handlelength": 1.2,
    "legend.columnspacing": 1.0,
    "legend.handletextpad": 0.4,
}
