"""The figure of an identification: structure function, fit and residual."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.surface.identify import Identification


def plot_identification(found: Identification, title: str = "") -> Figure:
    """Structure function with its fit above, residuals below, on one lag axis.

    Args:
        found: the identification.
        title: first line of the figure.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    lag = found.lags_m * 1e6
    above.loglog(lag, found.structure_m2 * 1e12, "o", color="C0", label="measured")
    above.loglog(lag, found.fitted_m2 * 1e12, "-", color="C1", label=f"fit, D = {found.D:.3f}")
    if found.noise_rms_m:
        above.axhline(
            2e12 * found.noise_rms_m**2,
            color="0.5",
            linestyle="--",
            label=f"noise, {found.noise_rms_m * 1e9:.0f} nm rms",
        )
    above.set_ylabel("structure function S, um²")
    low, high = found.D_interval
    above.set_title(
        f"{title}\nD = {found.D:.3f} [{low:.3f}, {high:.3f}], G = {found.G_m:.2e} m".strip(), fontsize=10
    )
    above.legend()
    below.semilogx(lag, 100.0 * np.log(found.structure_m2 / found.fitted_m2), "o-", color="C0")
    below.axhline(0.0, color="0.5", linewidth=0.8)
    below.set_ylabel("residual of ln S, %")
    below.set_xlabel("lag, um")
    for axes in (above, below):
        axes.grid(True, which="both", alpha=0.25)
    return figure
