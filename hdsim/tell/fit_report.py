"""What a fit writes: ``fit.json``, ``fitted.yaml``, one page, and its figures."""

from __future__ import annotations

import base64
import html
import io
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.estimate.determine import UNDETERMINED
from hdsim.estimate.estimation import Estimation, tied_groups
from hdsim.estimate.outcome import FitResult, result_of
from hdsim.estimate.write import FITTED, scenario_text
from hdsim.plot import units
from hdsim.tell import fit_figures
from hdsim.tell.beside import baselines
from hdsim.tell.staging import staged
from hdsim.tell.tables import numbers_table, table
from hdsim.tell.words import FROM_ALL_DATA, named_number, short_cut_words, shown, spoken, started, unit_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Dots an inch of the figures.
DPI = 160
GAP_HEAD = ("channel", "unit", "before", "after", "noise", "after/before", "after/noise")
_CAPTIONS = {
    "intervals": "Confidence intervals by the jackknife over blocks of time, valid for correlated residuals.",
    "correlation": "Near 1 or −1 only a combination of the two parameters is well determined.",
    "left": "Residual: measurement minus prediction, sensor offsets removed. Shaded: held-out data.",
}


def gap_rows(result: FitResult) -> list[list[str]]:
    """Rows of the table of held-out residuals; the columns are ``GAP_HEAD``."""
    rows = []
    for channel, gap in result.gap.items():
        unit = unit_of(gap)
        numbers = [f"{unit.factor * v:.3g}" for v in (gap.before, gap.after, gap.noise)]
        share = f"{100 * gap.after / gap.before:.0f} %" if gap.before > 0 else "-"
        multiple = f"{gap.after / gap.noise:.2f}" if gap.noise > 0 else "-"
        rows.append([spoken(channel), unit.name, *numbers, share, multiple])
    return rows


def summary(result: FitResult) -> str:
    """The fit in a sentence."""
    ratios = [n.posterior_over_prior for n in result.numbers.values()]
    known = [ratio for ratio in ratios if ratio is not None and ratio <= UNDETERMINED]
    said = f"{len(known)} of {len(result.numbers)} parameters are identifiable from these data"
    if result.moved:
        said += f"; {len(result.moved)} {'differs' if len(result.moved) == 1 else 'differ'} from the model: "
        said += ", ".join(_change(result, name) for name in result.moved)
    else:
        said += "; for none does the 95 % interval exclude the model's value"
    return f"{said}."


def _change(result: FitResult, name: str) -> str:
    number, (words, unit) = result.numbers[name], named_number(name)
    start = "" if number.start is None else f" instead of {shown(number.start)}"
    return f"{words} {shown(number.value)}{start} {unit}".rstrip()


def save_fit(found: Estimation, base: str | Path, out: str | Path) -> Path:
    """Write ``fit.json``, ``fitted.yaml``, the figures and ``fit.html``; returns the page's path.

    Args:
        found: the fit.
        base: file of the scenario that was fitted.
        out: directory; made when it is not there. Nothing is left in it when a file cannot be written.

    Raises:
        InputError: ``out`` cannot be written.
    """
    out, result = Path(out), result_of(found)
    result.scenario = str(out / "fitted.yaml")
    with staged(out) as stage:
        text = scenario_text(
            Path(base).resolve(), found.fit.state, found.refit.freedoms, found.start, out.resolve(), FITTED
        )
        (stage / "fitted.yaml").write_text(text, encoding="utf-8")
        (stage / "fit.json").write_text(result.model_dump_json(indent=2), encoding="utf-8")
        pictures = {
            "intervals": fit_figures.intervals_figure(found),
            "correlation": fit_figures.correlation_figure(found),
            "left": fit_figures.left_figure(found),
        }
        drawn = {name: _picture(stage, name, one) for name, one in pictures.items() if one is not None}
        (stage / "fit.html").write_text(page(found, result, drawn), encoding="utf-8")
    return out / "fit.html"


def _picture(stage: Path, name: str, figure: Figure) -> str:
    """Write a figure; returns it as HTML."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    (stage / f"fit_{name}.png").write_bytes(stream.getvalue())
    data = base64.b64encode(stream.getvalue()).decode()
    return (
        f"<figure><img alt='{name}' src='data:image/png;base64,{data}'>"
        f"<figcaption>{html.escape(_CAPTIONS[name])}</figcaption></figure>"
    )


def page(found: Estimation, result: FitResult, pictures: dict[str, str]) -> str:
    """The page.

    Args:
        found: the fit.
        result: what it found.
        pictures: figures as HTML, by name.
    """
    css = files("hdsim.tell").joinpath("page.css").read_text(encoding="utf-8")
    said = html.escape(summary(result))
    numbers = numbers_table(result.numbers, result.moved)
    if result.estimated_from == "all":
        numbers += f"<p class='note'>{FROM_ALL_DATA}</p>"
    gaps = table(GAP_HEAD, gap_rows(result), range(2, len(GAP_HEAD)))
    gaps += "".join(f"<p>{html.escape(started(line))}.</p>" for line in baselines(result.gap))
    if result.short_cut:
        gaps += f"<p class='note'>{short_cut_words(result.short_cut)}</p>"
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<title>Parameter estimates: hdsim fit</title><style>{css}:root{{--kind:var(--parameter)}}</style>",
        f"</head><body><main><p class='origin'>{html.escape(_origin(found))}</p>",
        "<header class='verdict'><p class='kind'>Parameter estimates</p><h1 "
        f"class='long'>{said}</h1></header>",
        _section("Parameters", numbers + pictures.get("intervals", "")),
        _section("Validation: RMS residual on held-out data", gaps + pictures.get("left", "")),
        _section("Identifiability", _identifiable(found) + pictures.get("correlation", "")),
        _section("Offsets of each record", _records(found)),
        _section("Problems in the data", _problems(result)) if result.data_problems else "",
        _section("Files", _files(result)),
        "</main></body></html>",
    ]
    return "\n".join(part for part in parts if part)


def _section(title: str, body: str) -> str:
    return f"<section><h2>{html.escape(title)}</h2>{body}</section>"


def _origin(found: Estimation) -> str:
    names = []
    for k, predictor in enumerate(found.bench.predictors):
        record = predictor.record
        held = ", held out" if k >= found.bench.training else ""
        names.append(f"{record.name} ({record.duration_s:.3g} s at {1 / record.period_s:.4g} Hz{held})")
    channels = ", ".join(spoken(channel) for channel in found.bench.channels)
    return f"hdsim fit: {', '.join(names)}. Predicted from the measured motion and compared: {channels}."


def _identifiable(found: Estimation) -> str:
    """The combinations that the data determine or not, and the groups that are strongly correlated."""
    rows = []
    for direction in found.directions:
        parts = sorted(direction.parts.items(), key=lambda part: -abs(part[1]))
        text = ", ".join(f"{weight:+.2f} {named_number(name)[0]}" for name, weight in parts)
        rows.append(
            [text, f"{shown(float(f'{100 * direction.spread:.2g}'))} %", "yes" if direction.seen else "no"]
        )
    seen = sum(direction.seen for direction in found.directions)
    body = (
        f"<p>The data determine {seen} of {len(found.directions)} combinations of the parameters "
        "(logarithms, in "
        "units of the prior standard deviations).</p>"
        + table(("combination", "posterior / prior spread", "identifiable"), rows, (1,))
    )
    groups = tied_groups(found.names, found.correlation)
    if groups:
        listed = "".join(
            f"<li>{html.escape('; '.join(named_number(name)[0] for name in group))}</li>" for group in groups
        )
        body += f"<p>Strongly correlated; only a combination is well determined:</p><ul>{listed}</ul>"
    return body


def _records(found: Estimation) -> str:
    """Offsets, and zeros of a locked drive."""
    channels = list(found.bench.channels)
    sizes = {c: max((abs(r.offsets.get(c, 0.0)) for r in found.readings), default=0.0) for c in channels}
    angle = [channel.endswith("angle") for channel in channels]
    shown_in = [
        units.for_angle(sizes[c]) if a else units.for_torque(sizes[c])
        for c, a in zip(channels, angle, strict=True)
    ]
    locked = any(reading.zero is not None for reading in found.readings)
    rows = []
    for reading in found.readings:
        cells = [reading.record + (" (held out)" if reading.held else "")]
        for channel, unit in zip(channels, shown_in, strict=True):
            value = reading.offsets.get(channel)
            cells.append("-" if value is None else f"{unit.factor * value:.3g}")
        if locked:
            cells.append("-" if reading.zero is None else f"{units.DEGREE.factor * reading.zero:.3g}")
        rows.append(cells)
    head = ["record", *(f"{spoken(c)} ({u.name})" for c, u in zip(channels, shown_in, strict=True))]
    head += ["zero when locked (deg)"] if locked else []
    note = "<p class='note'>Sensor offset: mean of measurement minus prediction.</p>"
    return table(head, rows, range(1, len(head))) + note


def _problems(result: FitResult) -> str:
    rows = [[p.severity, p.record, spoken(p.channel), p.message] for p in result.data_problems]
    return table(("severity", "record", "channel", "finding"), rows)


def _files(result: FitResult) -> str:
    name = html.escape(result.scenario)
    return (
        "<p><code>fit.json</code>: all results as data. <code>fitted.yaml</code>: the scenario with the "
        "estimates; "
        f"it extends yours.</p><pre>hdsim run {name}</pre>"
    )
