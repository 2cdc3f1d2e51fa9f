"""What a residual depends on, in pictures: shares by regressor, means over regressors, order spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdsim.plot import style, units
from hdsim.tell.figures import AFTER, BEFORE, POINTS, REFIT, WIDTH
from hdsim.tell.words import spoken

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hdsim.diagnosis.evidence import PlaceEvidence
    from hdsim.estimate.orders import Line
    from hdsim.estimate.records import Array
    from hdsim.tell.findings import Compared, Findings

#: Least share of a place that is drawn, most bars, and most panels beside them.
LEAST, MOST_BARS, MOST_PANELS = 0.02, 8, 3
#: Part of the best share that a place must have to get a panel.
NEAR = 0.35
#: Samples of which a drawn order spectrum is made, and the number of its orders.
SPECTRUM_SAMPLES, SPECTRUM_ORDERS = 6000, 700
#: Length of the pieces of which a spectrum over frequency is averaged, s.
SPECTRUM_S = 2.0
#: Coordinates over which the two directions of motion may differ.
_LOOPS = ("torque", "motor_torque", "output_angle", "temperature")

SHORT = {
    "wave_generator_angle": "orders of the wave generator",
    "torque": "torque at the output",
    "frequency": "frequency (vibration)",
}
LABELS = {
    "time": ("time", "s"),
    "velocity": ("motor velocity", "rad/s"),
    "direction": ("direction of motion", ""),
    "time_since_reversal": ("direction × log(1 + time since reversal / 20 ms)", ""),
    "output_angle": ("output angle", "rad"),
    "torque": ("torque at the output", "N m"),
    "motor_torque": ("motor torque of the model", "N m"),
    "temperature": ("temperature", "°C"),
    "frequency": ("frequency", "Hz"),
    "wave_generator_angle": ("wave-generator angle (orders)", ""),
}


def located_figure(found: Findings) -> Figure | None:
    """Shares of the re-fitted model's residual by regressor, means over the best, and order spectra."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    shown = _distinct(found.places)
    if not shown or not found.series:
        return None
    panels = [p for p in _panels(shown) if _drawable(found, p)]
    with rc_context(style.STYLE):
        rows = (len(panels) + 2) // 2
        figure = Figure(figsize=(WIDTH, 2.75 * rows), layout="constrained")
        grid = figure.add_gridspec(rows, 2)
        # Two panels stand over one another beside the bars, three fill the square.
        places = (
            [grid[:, 0], grid[0, 1], grid[1, 1]]
            if len(panels) == 2
            else [grid[k // 2, k % 2] for k in range(4)[: len(panels) + 1]]
        )
        axes_of = [figure.add_subplot(place) for place in places]
        _shares(axes_of[0], shown[:MOST_BARS], room=10 if len(panels) == 2 else 5)
        verdict = found.verdict
        changed = verdict.verdict == "effect" or verdict.curve is not None
        for axes, place in zip(axes_of[1:], panels, strict=True):
            if place.coordinate == "wave_generator_angle":
                _spectrum(axes, found, place, after=changed)
            elif place.coordinate == "frequency":
                _ringing(axes, found, place, after=changed)
            else:
                _over(axes, found, place, after=changed)
        if panels:
            axes_of[1].legend(loc="best", frameon=True, framealpha=0.8, edgecolor="none")
    return figure


def _first(found: Findings, channel: str) -> Compared:
    """The first series of a channel, which has the coordinates."""
    return next(series for series in found.series if series.channel == channel)


def _drawable(found: Findings, place: PlaceEvidence) -> bool:
    if place.channel not in found.channels:
        return False
    if place.coordinate == "wave_generator_angle":
        return bool(found.lines.get(place.channel))
    return place.coordinate == "frequency" or place.coordinate in _first(found, place.channel).over


def _panels(shown: Sequence[PlaceEvidence]) -> list[PlaceEvidence]:
    """Places that get a picture: the best of each channel first, then further quantities."""
    telling = [p for p in shown if p.share >= NEAR * shown[0].share and p.coordinate in LABELS]
    if any(place.coordinate == "velocity" for place in telling):
        telling = [place for place in telling if place.coordinate != "direction"]  # velocity shows it too
    first = {place.channel: place for place in reversed(telling)}
    chosen = [place for place in telling if first[place.channel] is place]
    for place in telling:
        if place.coordinate not in {other.coordinate for other in chosen}:
            chosen.append(place)
    # Two would leave a hole in the page.
    rest = [p for p in shown if p not in chosen and p.coordinate in LABELS and p.coordinate != "direction"]
    chosen += rest[:1] if len(chosen) == 2 else []
    return sorted(chosen[:MOST_PANELS], key=lambda place: -place.share)


def _distinct(places: Sequence[PlaceEvidence]) -> list[PlaceEvidence]:
    """The best entry of each coordinate and channel that is worth a bar, by falling share."""
    found: dict[tuple[str, str], PlaceEvidence] = {}
    for place in places:
        if place.share >= LEAST:
            found.setdefault((place.coordinate, place.channel), place)
    return list(found.values())


def _shares(axes: Axes, places: Sequence[PlaceEvidence], room: int) -> None:
    for k, place in enumerate(places):
        axes.barh(k, 100 * place.share, 0.68, color=REFIT)
        axes.text(100 * place.share + 1.5, k, f"{100 * place.share:.0f} %", va="center", fontsize=8.5)
    names = [
        f"{spoken(place.channel)} over {SHORT.get(place.coordinate) or spoken(place.coordinate)}"
        for place in places
    ]
    axes.set_yticks(range(len(places)), names)
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(0, 112)
    axes.set_xticks([0, 25, 50, 75, 100])
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("share of the re-fitted model's residual (%)")
    axes.set_title("explained share by regressor")
    axes.set_ylim(max(len(places), room) - 0.4, -0.6)


def _over(axes: Axes, found: Findings, place: PlaceEvidence, *, after: bool) -> None:
    """The residual over a regressor: points, and the mean over bins before and after."""
    series = _first(found, place.channel)
    used = np.flatnonzero(series.train)
    values = {stage: rest[used] for stage, rest in series.left.items()}
    low, high = np.quantile(values["refit"], [0.01, 0.99])
    unit = _unit(place.channel, max(abs(low), abs(high)))
    x = series.over[place.coordinate][used]
    label, name = LABELS.get(place.coordinate, (spoken(place.coordinate), ""))
    if name == "rad":
        across = units.for_angle(float(np.max(np.abs(x))))
        x, name = across.factor * x, across.name
    thin = max(1, len(used) // POINTS)
    axes.plot(
        x[::thin], unit.factor * values["refit"][::thin], ".", markersize=2, color="#9A9A9A", alpha=0.45
    )
    turned = series.over["direction"][used]
    if place.coordinate in _LOOPS and len(np.unique(turned)) > 1:
        _mean(
            axes, x[turned > 0], unit.factor * values["refit"][turned > 0], BEFORE, "re-fitted, forwards", "-"
        )
        _mean(
            axes,
            x[turned < 0],
            unit.factor * values["refit"][turned < 0],
            BEFORE,
            "re-fitted, backwards",
            "--",
        )
    else:
        _mean(axes, x, unit.factor * values["refit"], BEFORE, "residual of the re-fitted model")
    if after:
        _mean(axes, x, unit.factor * values["after"], AFTER, "residual of the final model")
    axes.set_ylim(*_limits(unit.factor * low, unit.factor * high))
    axes.set_xlabel(f"{label} ({name})" if name else label)
    axes.set_ylabel(f"residual ({unit.name})")
    axes.set_title(
        f"{spoken(place.channel)}: {100 * place.share:.0f} % over "
        f"{SHORT.get(place.coordinate) or spoken(place.coordinate)}"
    )


def _limits(low: float, high: float) -> tuple[float, float]:
    room = 0.4 * max(high - low, 1e-12)
    return low - room, high + room


def _mean(axes: Axes, x: Array, values: Array, colour: str, label: str, line: str = "-") -> None:
    """Draw the mean of ``values`` over bins of ``x`` that hold equally many samples; not across holes."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, 41))) if len(x) > 80 else np.zeros(0)
    if len(edges) < 4:
        kinds = np.unique(x)
        if 1 < len(kinds) < 4:
            means = [values[x == kind].mean() for kind in kinds]
            axes.plot(kinds, means, "o" + line, color=colour, linewidth=1.8, label=label)
        return
    inside = np.clip(np.searchsorted(edges, x) - 1, 0, len(edges) - 2)
    count = np.maximum(np.bincount(inside, minlength=len(edges) - 1), 1)
    at, mean = (np.bincount(inside, v, len(edges) - 1) / count for v in (x, values))
    hole = 1 + np.flatnonzero(np.diff(at) > max(6.0 * float(np.median(np.diff(at))), 0.1 * float(np.ptp(x))))
    at, mean = np.insert(at, hole, np.nan), np.insert(mean, hole, np.nan)
    axes.plot(at, mean, line, color=colour, linewidth=1.8, label=label)


def _spectrum(axes: Axes, found: Findings, place: PlaceEvidence, *, after: bool) -> None:
    """Amplitude over order per wave-generator turn, by least squares over the measured angle."""
    own = [s for s in found.series if s.channel == place.channel and s.train.any()]
    lines = found.lines[place.channel]
    highest = max(5.0, 1.15 * max(line.order for line in lines))
    orders = np.unique(
        np.concatenate([np.linspace(0.5, highest, SPECTRUM_ORDERS), [line.order for line in lines]])
    )
    angle = np.concatenate([series.motor_angle[series.train] for series in own])
    part = np.arange(len(angle))
    if len(part) > SPECTRUM_SAMPLES:
        part = np.random.default_rng(0).choice(len(part), SPECTRUM_SAMPLES, replace=False)
    waves = np.exp(-1j * np.outer(orders, angle[part]))
    sizes = {}
    for stage in ("refit", "after"):
        values = np.concatenate([series.left[stage][series.train] for series in own])[part]
        sizes[stage] = 2.0 * np.abs(waves @ (values - values.mean())) / len(part)
    unit = _unit(place.channel, float(sizes["refit"].max()))
    axes.plot(
        orders,
        unit.factor * sizes["refit"],
        color=BEFORE,
        linewidth=1.1,
        label="residual of the re-fitted model",
    )
    if after:
        axes.plot(
            orders,
            unit.factor * sizes["after"],
            color=AFTER,
            linewidth=1.1,
            label="residual of the final model",
        )
    top = unit.factor * float(sizes["refit"].max())
    for at, text in _peaks(found, lines, highest, own[0].ratio):
        height = unit.factor * float(np.interp(at, orders, sizes["refit"]))
        axes.annotate(text, (at, height), (0, 3), textcoords="offset points", ha="center", fontsize=8.5,
                      fontweight="bold")  # fmt: skip
    axes.set_xlim(0, highest)
    axes.set_ylim(0, 1.28 * top)
    axes.set_xlabel("order: periods per wave-generator turn")
    axes.set_ylabel(f"amplitude ({unit.name})")
    axes.set_title(f"{spoken(place.channel)}: {100 * place.share:.0f} % over orders")


def _ringing(axes: Axes, found: Findings, place: PlaceEvidence, *, after: bool) -> None:
    """Amplitude density over frequency (Welch's method), its highest peak labelled."""
    from scipy.signal import welch

    series = _first(found, place.channel)
    rate = 1.0 / series.period_s
    good = series.train | series.hold
    densities = {}
    for stage, rest in series.left.items():
        values = np.where(good, rest, 0.0)
        length = min(len(values), max(256, int(SPECTRUM_S * rate)))
        frequency, power = welch(values, rate, nperseg=length)
        densities[stage] = np.sqrt(power[1:])
    frequency = frequency[1:]
    unit = _unit(place.channel, float(densities["refit"].max()))
    axes.loglog(
        frequency, unit.factor * densities["refit"], color=BEFORE, label="residual of the re-fitted model"
    )
    if after:
        axes.loglog(
            frequency, unit.factor * densities["after"], color=AFTER, label="residual of the final model"
        )
    k = int(np.argmax(densities["refit"] * np.sqrt(frequency)))
    axes.annotate(f"{frequency[k]:.3g} Hz", (frequency[k], unit.factor * densities["refit"][k]), (0, 3),
                  textcoords="offset points", ha="center", fontsize=8.5, fontweight="bold")  # fmt: skip
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel(f"amplitude density ({unit.name}/√Hz)")
    axes.set_title(f"{spoken(place.channel)}: {100 * place.share:.0f} % over frequency")


def _peaks(found: Findings, lines: Sequence[Line], span: float, ratio: float) -> list[tuple[float, str]]:
    """Where labels stand and what they say; those of neighbours are joined.

    A line that these turns cannot tell from another order of the drive bears both names: errors of the fixed
    member come at 2 and 4, those of the turning one at 2 and 4 less 2 and 4 over the ratio.
    """
    relative = 1.0 - 1.0 / ratio
    known = (2.0, 2.0 * relative, 4.0, 4.0 * relative)

    def name(line: Line) -> str:
        near = [order for order in known if abs(order - line.order) < 0.7 / max(found.turns, 1e-9)]
        return "/".join(f"{order:.4g}" for order in near) if len(near) > 1 else f"{line.order:.4g}"

    groups: list[list[Line]] = []
    for line in sorted(lines, key=lambda line: line.order):
        if groups and line.order - groups[-1][-1].order < 0.07 * span:
            groups[-1].append(line)
        else:
            groups.append([line])
    return [
        (
            max(group, key=lambda line: line.amplitude).order,
            " · ".join(dict.fromkeys(name(line) for line in group)),
        )
        for group in groups
    ]


def _unit(channel: str, size: float) -> units.Unit:
    return units.for_error(size) if channel.endswith("angle") else units.for_torque(size)
