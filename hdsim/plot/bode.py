"""The Bode plot of a linear model: magnitude with units, unwrapped phase, the modes marked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.plot import style
from hdsim.simulation.modes import modes
from hdsim.simulation.ports import OUTPUT_UNITS

if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: What is drawn of the outputs unless something else is asked for.
DRAWN = ("motor_velocity", "output_velocity", "output_torque")

#: Damping ratio above which a mode shows no peak and is not marked.
_PEAKLESS = 0.7

#: Share of the largest response to an output below which a curve is rounding.
ROUNDING = 1e-9

#: Units of the inputs of open and closed loops.
_INPUT_UNITS = {
    "motor_torque": "N m",
    "load_torque": "N m",
    "reference_position": "rad",
    "reference_velocity": "rad/s",
    "reference_acceleration": "rad/s²",
}


def plot_bode(
    system: control.StateSpace,
    *,
    inputs: tuple[str, ...] | None = None,
    outputs: tuple[str, ...] | None = None,
    range_hz: tuple[float, float] | None = None,
    title: str = "",
    subtitle: str = "",
    size_in: tuple[float, float] = style.PAGE,
) -> Figure:
    """Draw magnitude and phase from every input (a line) to every output (a column).

    Args:
        system: a model whose inputs and outputs have the names of ``hdsim.simulation.linear``.
        inputs: names of inputs; when None all torques, or of a closed loop the first reference and the load.
        outputs: names of outputs; those of ``DRAWN`` that there are when None.
        range_hz: lowest and highest frequency; around the oscillating modes when None.
        title: heading of the page.
        subtitle: line below it.
        size_in: width and height in inches.

    Raises:
        InputError: an input or output that the system does not have.
    """
    import control as ct
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    drawn_inputs = _chosen(system.input_labels, inputs, _default_inputs(system.input_labels), "input")
    drawn_outputs = _chosen(system.output_labels, outputs, DRAWN, "output")
    marked = [
        mode.frequency_hz for mode in modes(system) if mode.oscillates and mode.damping_ratio < _PEAKLESS
    ]
    frequencies = frequency_grid(marked, range_hz)
    response: Any = ct.frequency_response(system, 2.0 * np.pi * frequencies, squeeze=False)
    with rc_context(style.STYLE):
        figure = Figure(figsize=size_in, dpi=style.DPI)
        width, height = size_in
        figure.text(0.12 / width, 1.0 - 0.08 / height, title, fontsize=14, fontweight="bold", va="top")
        figure.text(0.12 / width, 1.0 - 0.36 / height, subtitle, fontsize=9, va="top")
        top = 1.0 - 0.62 / height
        figure.set_layout_engine(ConstrainedLayoutEngine(rect=(0.0, 0.0, 1.0, top), w_pad=0.09, h_pad=0.05))
        axes = figure.subplots(2, len(drawn_outputs), sharex=True, squeeze=False)
        for column, output in enumerate(drawn_outputs):
            upper, lower = axes[:, column]
            row = list(system.output_labels).index(output)
            for name, colour in zip(drawn_inputs, _COLOURS, strict=False):
                at = list(system.input_labels).index(name)
                if not np.max(response.magnitude[row, at]) > ROUNDING * np.max(response.magnitude[row]):
                    # Not connected, as motor and output across the backlash: the curve is rounding.
                    continue
                unit = f"{OUTPUT_UNITS.get(output, '1')} / {_INPUT_UNITS.get(name, '1')}"
                label = f"from {name.replace('_', ' ')}, ({unit.replace(' / ', ') / (')})"
                upper.loglog(frequencies, response.magnitude[row, at], color=colour, label=label)
                phase = np.degrees(np.unwrap(response.phase[row, at]))
                # Phases count modulo 360 degrees: start each curve between -180 and 180.
                lower.semilogx(frequencies, phase - 360.0 * np.round(phase[0] / 360.0), color=colour)
            for one in (upper, lower):
                for frequency in marked:
                    one.axvline(frequency, color=style.GREY, linewidth=0.7, linestyle=":", zorder=1)
            upper.set_title(f"To {output.replace('_', ' ')}", pad=8)
            upper.legend(loc="best", frameon=True, framealpha=0.9, edgecolor="none")
            lower.yaxis.set_major_locator(_every_45(lower))
            lower.set_xlabel("frequency (Hz)")
            lower.margins(x=0.0)
        axes[0, 0].set_ylabel("magnitude")
        axes[1, 0].set_ylabel("phase (deg)")
    return figure


_COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.BLACK)


def frequency_grid(marked: list[float], range_hz: tuple[float, float] | None) -> Array:
    """Frequencies in Hz, even on the logarithmic axis and dense around the modes, sorted.

    Args:
        marked: frequencies of the modes, Hz.
        range_hz: lowest and highest; two octaves and more around the modes when None.

    Raises:
        InputError: the range is empty or not positive.
    """
    if range_hz is None:
        lowest, highest = min(marked, default=10.0) / 20.0, max(marked, default=10.0) * 10.0
    else:
        lowest, highest = range_hz
    if not 0.0 < lowest < highest:
        raise InputError(f"a frequency range must be positive and rise, found {lowest:g} to {highest:g} Hz")
    parts = [np.geomspace(lowest, highest, 1500)]
    parts += [frequency * np.linspace(0.9, 1.1, 401) for frequency in marked]
    grid = np.unique(np.concatenate(parts))
    return np.asarray(grid[(grid >= lowest) & (grid <= highest)])


def _default_inputs(labels: list[str]) -> tuple[str, ...]:
    if "motor_torque" in labels or not labels:
        return tuple(labels)
    return tuple(dict.fromkeys((labels[0], labels[-1])))


def _chosen(
    labels: list[str], asked: tuple[str, ...] | None, default: tuple[str, ...], what: str
) -> list[str]:
    """The names to draw."""
    if asked is None:
        found = [name for name in default if name in labels]
        return found or list(labels[:3])
    for name in asked:
        if name not in labels:
            raise InputError(f"no {what} {name!r} in the model; there are: {', '.join(labels)}")
    return list(asked)


def _every_45(axes: Any) -> Any:
    """Ticks at multiples of 45 degrees, or coarser where the phase goes far."""
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_ylim()
    # Whole steps, so that a phase that hardly changes looks like one.
    low, high = 45.0 * np.floor(low / 45.0), 45.0 * np.ceil(high / 45.0)
    axes.set_ylim(low, high)
    return MultipleLocator(45.0 if high - low < 400.0 else 90.0)
