"""The report: one self-contained page that reads from the verdict downwards, and its figures as PNG."""

from __future__ import annotations

import base64
import html
import io
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.tell import figures, sections
from hdsim.tell.beside import also_moved, baselines, last_model
from hdsim.tell.figures_where import located_figure
from hdsim.tell.findings import Findings
from hdsim.tell.tables import GAP_HEAD, gap_rows, section, table
from hdsim.tell.why import why
from hdsim.tell.wording import KINDS, gains, headline, meaning, sureness
from hdsim.tell.words import short, spoken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.diagnosis.verdict import Verdict

#: Dots an inch of the figures: sharp on screens with small pixels.
DPI = 160
#: Sentences longer than this are set smaller.
LONG = 150

_CAPTIONS = {
    "gap": "Root-mean-square residual (measurement minus model) on held-out data, which no fit has used (in "
    "brackets: relative to the model as given). Whiskers: 95 % confidence intervals over blocks of time. "
    "Dashed: noise floor of the sensor, estimated from neighbouring readings. It is a reference, not a lower "
    "bound: slowly varying errors exceed it, and a model may predict a part of them.",
    "located": "Share of the re-fitted model's residual that is a function of a single regressor, "
    "cross-validated over blocks of time; the shares of correlated regressors overlap. Grey: samples. "
    "Orange: residual of the re-fitted model. Green: residual of the final model.",
    "traces": "The stretch of held-out data in which the model as given has its largest residual. Grey band: "
    "plus and minus two standard deviations of the noise. Sensor offsets are removed.",
    "whole": "The residual over the whole record. Shaded: held-out data, used by no fit.",
    "curve": "The curve with the 95 % confidence interval of each node. What the parameters of the model "
    "explain equally well, such as a constant, is not part of it.",
}
_ALTS = {
    "gap": "bar chart of the RMS residual of each channel",
    "located": "residual over its regressors",
    "traces": "measurement and model before and after over time",
    "whole": "residual over the whole record",
    "curve": "estimated curve",
}


def write_report(found: Findings, out: Path) -> Path:
    """Write ``report.html`` and its figures into a directory; returns the report's path."""
    pictures: dict[str, Figure | None] = {
        "gap": figures.gap_figure(found.verdict, figures.gap_bars(found)),
        "located": located_figure(found),
        "traces": figures.trace_figure(found),
        "whole": figures.whole_figure(found),
    }
    if found.verdict.curve is not None:
        pictures["curve"] = figures.curve_figure(found.verdict.curve)
    embedded = {}
    for name, figure in pictures.items():
        if figure is not None:
            stream = io.BytesIO()
            figure.savefig(stream, format="png", dpi=DPI)
            (out / f"{name}.png").write_bytes(stream.getvalue())
            embedded[name] = _figure(name, stream.getvalue())
    path = out / "report.html"
    path.write_text(_page(found, embedded), encoding="utf-8")
    return path


def _figure(name: str, content: bytes) -> str:
    data = base64.b64encode(content).decode()
    return (
        f"<figure><img alt='{_ALTS[name]}' "
        f"src='data:image/png;base64,{data}'><figcaption>{_CAPTIONS[name]}</figcaption></figure>"
    )


def _page(found: Findings, pictures: dict[str, str]) -> str:
    verdict = found.verdict
    css = files("hdsim.tell").joinpath("page.css").read_text(encoding="utf-8")
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<meta name='description' content='{html.escape(verdict.sentence)}'>",
        f"<title>{KINDS[verdict.verdict]}: hdsim diagnose</title>",
        f"<style>{css}:root{{--kind:var(--{verdict.verdict})}}</style></head><body><main>",
        _origin(found),
        _head(found),
        section(
            "RMS residual on held-out data",
            pictures.get("gap", "<p>No data were held out, so there is no validation.</p>")
            + _beside(verdict)
            + (_as_numbers(verdict) if verdict.gap else ""),
        ),
        why(found),
        sections.confusions(verdict),
        sections.following(verdict),
        sections.curve(found, pictures.get("curve", "")),
        section(
            "What the residual depends on",
            pictures.get(
                "located", "<p>The residual of the re-fitted model depends on nothing that was measured.</p>"
            )
            + sections.orders(verdict),
        ),
        _over_time(pictures),
        sections.fitted(found),
        sections.data(verdict),
        sections.not_tried(verdict),
        sections.method(found),
        sections.written(verdict, pictures),
    ]
    return "\n".join(part for part in [*parts, "</main></body></html>"] if part)


def _beside(verdict: Verdict) -> str:
    listed = "".join(f"<li>{html.escape(line)}</li>" for line in baselines(verdict.gap, last_model(verdict)))
    return f"<p>Baselines, fitted to the same samples:</p><ul>{listed}</ul>" if listed else ""


def _as_numbers(verdict: Verdict) -> str:
    rows = table(GAP_HEAD, gap_rows(verdict), range(2, len(GAP_HEAD)))
    return f"<details><summary>table</summary>{rows}</details>"


def _over_time(pictures: dict[str, str]) -> str:
    body = pictures.get("traces", "") + pictures.get("whole", "")
    return section("Measurement and model over time", body) if body else ""


def _origin(found: Findings) -> str:
    names = [
        f"{run.name} ({short(run.duration_s)} s at {short(1 / run.period_s, 4)} Hz"
        f"{f', means of {run.readings} readings' * (run.readings > 1)}{', held out' * run.held})"
        for run in found.runs
    ]
    channels = ", ".join(map(spoken, found.channels))
    text = f"hdsim diagnose: {', '.join(names)}. Predicted from the measured motion and compared: {channels}."
    return f"<p class='origin'>{html.escape(text)}</p>" if found.runs else ""


def _head(found: Findings) -> str:
    verdict = found.verdict
    sure = sureness(found)
    said = headline(found)
    long = " class='long'" if len(said) > LONG else ""
    listed = "".join(f"<li>{html.escape(line)}</li>" for line in gains(verdict))
    means = f"{meaning(found)} {also_moved(verdict)}".rstrip()
    unseen = "RMS residual on held-out data:" if verdict.gap else "No data were held out."
    return (
        "<header class='verdict'><p "
        f"class='kind'>{KINDS[verdict.verdict]}</p><h1{long}>{html.escape(said)}</h1><div "
        f"class='facts'><div><h2>Confidence</h2><p class='big'>{html.escape(sure.words)}: <span "
        f"class='number'>{html.escape(sure.number)}</span></p>"
        + (f"<p class='left'>But {html.escape(sure.left)}.</p>" if sure.left else "")
        + "".join(f"<p>{html.escape(line)}</p>" for line in sure.details)
        + f"</div><div><h2>What it means</h2><p>{html.escape(means)}</p>"
        f"{_pointers(verdict)}</div>"
        f"<div><h2>Validation</h2><p>{unseen}</p><ul>{listed}</ul></div></div></header>"
    )


def _pointers(verdict: Verdict) -> str:
    """Where to read on, when something needs the reader's attention."""
    said = []
    serious = [p for p in verdict.data_problems if p.severity != "info"]
    if serious:
        noun = "problem" if len(serious) == 1 else "problems"
        said.append(f"<a href='#data'>{len(serious)} {noun} in the data</a>")
    if verdict.next_experiment is not None:
        said.append("<a href='#next'>the next experiment</a>")
    if verdict.curve is not None:
        said.append("<a href='#curve'>the curve</a>")
    return f"<p>See also: {', '.join(said)}.</p>" if said else ""
