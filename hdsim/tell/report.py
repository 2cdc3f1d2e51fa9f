"""The report: one self-contained page that reads from the verdict downwards, and its figures as PNG."""

from __future__ import annotations

import base64
import html
import io
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from hdsim.diagnose.name import LEAST_SHARE, LEVEL
from hdsim.diagnose.verdict import Verdict
from hdsim.tell import figures
from hdsim.tell.figures_where import located_figure
from hdsim.tell.tables import GAP_HEAD, gap_rows, numbers_table, table
from hdsim.tell.wording import (
    KINDS,
    gains,
    headline,
    meaning,
    percent,
    shown,
    spoken,
    sureness,
    titles_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.diagnose.workflow import Diagnosis

#: Dots an inch of the figures: sharp on screens with small pixels.
DPI = 160
#: Sentences longer than this are set smaller.
LONG = 150

_CAPTIONS = {
    "gap": "Root-mean-square difference between measurement and model on data that no fit has seen, in the "
    "unit of each channel (in brackets: as a share of the model as given). Whiskers: 95 % intervals over "
    "blocks of time. Dashed line: noise of the sensor, below which no model can come.",
    "located": "How much of what the re-fitted model leaves is a function of one quantity, checked on "
    "blocks of time left out of the fit; the shares of related quantities overlap. Grey: measured samples. "
    "Orange: what the re-fitted model leaves. Green: what is left with what was found.",
    "traces": "The stretch of held-out data in which the model as given is farthest off. Grey band: "
    "twice the sensor's noise to either side; what stays inside is explained. Sensors' offsets are taken "
    "out.",
    "whole": "The same difference over the whole record. Shaded: held out, no fit has seen it.",
    "curve": "The curve that is missing, with the 95 % interval of each corner. What the model's own numbers "
    "could explain as well, such as a constant, is left out.",
}
_ALTS = {
    "gap": "bar chart of the gap of each channel",
    "located": "where the difference lives",
    "traces": "measured, model before and model after over time",
    "whole": "what is left over the whole record",
    "curve": "the curve found",
}


def write_report(diagnosis: Diagnosis, out: Path) -> Path:
    """Write ``report.html`` and its figures into a directory; returns the report's path."""
    pictures: dict[str, Figure | None] = {
        "gap": figures.gap_figure(diagnosis.verdict, figures.gap_bars(diagnosis)),
        "located": located_figure(diagnosis),
        "traces": figures.trace_figure(diagnosis),
        "whole": figures.whole_figure(diagnosis),
    }
    if diagnosis.verdict.curve is not None:
        pictures["curve"] = figures.curve_figure(diagnosis.verdict.curve)
    embedded = {}
    for name, figure in pictures.items():
        if figure is not None:
            stream = io.BytesIO()
            figure.savefig(stream, format="png", dpi=DPI)
            (out / f"{name}.png").write_bytes(stream.getvalue())
            embedded[name] = _figure(name, stream.getvalue())
    path = out / "report.html"
    path.write_text(_page(diagnosis, embedded), encoding="utf-8")
    return path


def _figure(name: str, content: bytes) -> str:
    data = base64.b64encode(content).decode()
    return (
        f"<figure><img alt='{_ALTS[name]}' "
        f"src='data:image/png;base64,{data}'><figcaption>{_CAPTIONS[name]}</figcaption></figure>"
    )


def _page(diagnosis: Diagnosis, pictures: dict[str, str]) -> str:
    verdict = diagnosis.verdict
    css = files("hdsim.diagnose").joinpath("page.css").read_text(encoding="utf-8")
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"<meta name='description' content='{html.escape(verdict.sentence)}'>",
        f"<title>{KINDS[verdict.verdict]}: hdsim diagnose</title>",
        f"<style>{css}:root{{--kind:var(--{verdict.verdict})}}</style></head><body><main>",
        _origin(diagnosis),
        _head(diagnosis),
        _section(
            "How far off the model is, before and after",
            pictures.get("gap", "")
            + "<details><summary>the same as numbers</summary>"
            + table(GAP_HEAD, gap_rows(verdict), range(2, len(GAP_HEAD)))
            + "</details>",
        ),
        _confusions(verdict),
        _next(verdict),
        _curve(verdict, pictures),
        _section(
            "Where the difference lives",
            pictures.get(
                "located", "<p>What the re-fitted model leaves is a function of nothing measured.</p>"
            ),
        ),
        _section(
            "Measured, and the model before and after", pictures.get("traces", "") + pictures.get("whole", "")
        ),
        _fitted(diagnosis),
        _data(verdict),
        _not_tried(verdict),
        _method(diagnosis),
        _files(verdict, pictures),
    ]
    return "\n".join(part for part in [*parts, "</main></body></html>"] if part)


def _section(title: str, body: str, kind: str = "") -> str:
    return f"<section{f' class={kind}' if kind else ''}><h2>{html.escape(title)}</h2>{body}</section>"


def _origin(diagnosis: Diagnosis) -> str:
    bench = diagnosis.bench
    names = []
    for k, predictor in enumerate(bench.predictors):
        record = predictor.record
        held = ", held out" if k >= bench.training else ""
        names.append(f"{record.name} ({record.duration_s:.3g} s at {1 / record.period_s:.4g} Hz{held})")
    channels = ", ".join(spoken(channel) for channel in bench.channels)
    text = f"hdsim diagnose: {', '.join(names)}. Predicted from the measured motion and compared: {channels}."
    return f"<p class='origin'>{html.escape(text)}</p>"


def _head(diagnosis: Diagnosis) -> str:
    verdict = diagnosis.verdict
    sure = sureness(diagnosis)
    said = headline(verdict)
    long = " class='long'" if len(said) > LONG else ""
    listed = "".join(f"<li>{html.escape(line)}</li>" for line in gains(verdict))
    unseen = "Gap on data that no fit has seen:" if verdict.gap else "No data were held out."
    return (
        "<header class='verdict'><p "
        f"class='kind'>{KINDS[verdict.verdict]}</p><h1{long}>{html.escape(said)}</h1><div "
        f"class='facts'><div><h2>How sure</h2><p class='big'>{html.escape(sure.words)}: <span "
        f"class='number'>{html.escape(sure.number)}</span></p>"
        + "".join(f"<p>{html.escape(line)}</p>" for line in sure.details)
        + f"</div><div><h2>What it "
        f"means</h2><p>{html.escape(meaning(verdict))}</p>{_pointers(verdict)}</div><div><h2>What it "
        f"gains</h2><p>{unseen}</p><ul>{listed}</ul></div></div></header>"
    )


def _pointers(verdict: Verdict) -> str:
    """Where to read on, when something needs the reader's attention."""
    said = []
    serious = [p for p in verdict.data_problems if p.severity != "info"]
    if serious:
        noun = "problem" if len(serious) == 1 else "problems"
        said.append(f"<a href='#data'>{len(serious)} {noun} in the data</a>")
    if verdict.next_experiment is not None:
        said.append("<a href='#next'>what to measure next</a>")
    if verdict.curve is not None:
        said.append("<a href='#curve'>the curve</a>")
    return f"<p>See also: {', '.join(said)}.</p>" if said else ""


def _confusions(verdict: Verdict) -> str:
    body = ""
    for effect in verdict.effects:
        if not effect.indistinguishable_from:
            continue
        own, *others = titles_of(effect)
        lines = ""
        for name, title in zip(effect.indistinguishable_from, others, strict=True):
            rule = effect.separated_by.get(name) or "no rule is recorded"
            lines += f"<li><b>{html.escape(title)}</b>. What separates the two: {html.escape(rule)}.</li>"
        body += f"<p>These data cannot tell <b>{html.escape(own)}</b> from:</p><ul>{lines}</ul>"
    if verdict.suspects:
        listed = ", ".join(f"{spoken(name)} ({percent(share)})" for name, share in verdict.suspects.items())
        body += f"<p>Effects that explain a part, not enough to be named: {html.escape(listed)}.</p>"
    return _section("Could be confused", body, "warn") if body else ""


def _next(verdict: Verdict) -> str:
    proposal = verdict.next_experiment
    if proposal is None:
        return ""
    rows = [
        [c.title, _short(c.separation), f"{_short(c.relative)} ×" if c.relative else "-"]
        for c in proposal.considered[:8]
    ]
    body = f"<p><b>{html.escape(proposal.sentence)}</b></p>"
    if proposal.scenario:
        body += (
            f"<p>It is ready as a scenario: <code>{html.escape(Path(proposal.scenario).name)}</code>; "
            f"<code>hdsim run {html.escape(proposal.scenario)}</code> shows what the model expects.</p>"
        )
    body += (
        "<p class='note'>d′ is the distance between the two candidates that are hardest to tell apart, in "
        "standard deviations of the noise, after each has been fitted to the other as well as it can be: 1 "
        "is a guess that is right in 69 % of cases, 3 in 93 %, more is safe. Here "
        f"{_short(proposal.separation)} is expected, which is right in {percent(proposal.correct)} of cases "
        "if the noise is all that is unknown.</p>"
    )
    head = ("experiment", "expected d′", "against repeating the record")
    return f"<section id='next'><h2>What to measure next</h2>{body}{table(head, rows, (1, 2))}</section>"


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 9.95 else f"{value:.2g}"


def _curve(verdict: Verdict, pictures: dict[str, str]) -> str:
    curve = verdict.curve
    if curve is None:
        return ""
    rows = [
        [shown(at), shown(value), f"{shown(low)} to {shown(high)}"]
        for at, value, (low, high) in zip(curve.at, curve.values, curve.intervals, strict=True)
    ]
    head = (f"{spoken(curve.coordinate)} ({curve.coordinate_unit})", f"value ({curve.unit})", "95 % interval")
    others = ", ".join(
        f"{words} ({percent(share)})" for words, share in curve.tried.items() if words != curve.words
    )
    body = (
        f"<p><b>{html.escape(curve.words[:1].upper() + curve.words[1:])}</b> explains {percent(curve.share)} "
        "of what the model leaves (checked on blocks of time left out of the fit).</p>"
        + pictures.get("curve", "")
        + (f"<p class='note'>Other curves that were tried: {html.escape(others)}.</p>" if others else "")
        + f"<details><summary>its corners as numbers</summary>{table(head, rows, (0, 1, 2))}</details>"
    )
    return f"<section id='curve'><h2>The curve that is missing</h2>{body}</section>"


def _fitted(diagnosis: Diagnosis) -> str:
    verdict, body = diagnosis.verdict, ""
    added = diagnosis.final.state.added
    for effect, own in zip(verdict.effects, added, strict=False):
        title = effect.title or spoken(effect.name)
        body += f"<h3>{html.escape(title[:1].upper() + title[1:])} (new)</h3>"
        body += numbers_table(effect.parameters, settings=own.settings())
    if verdict.parameters:
        body += "<h3>The model's own numbers</h3>" + numbers_table(verdict.parameters, verdict.moved)
        body += (
            "<p class='note'>Marked at the left: the model's number lies outside the interval. Intervals "
            "come from the spread over blocks of time, not from the noise alone.</p>"
        )
    return _section("Fitted numbers", body) if body else ""


def _data(verdict: Verdict) -> str:
    if not verdict.data_problems:
        return _section("The data", "<p>No gap, spike, saturation, wrong unit or wrong sign was found.</p>")
    lines = "".join(
        f"<tr><td class='{html.escape(p.severity)}'>{html.escape(p.severity)}</td>"
        + "".join(f"<td>{html.escape(c)}</td>" for c in (p.record, spoken(p.channel), p.kind, p.message))
        + "</tr>"
        for p in verdict.data_problems
    )
    head = "".join(f"<th>{h}</th>" for h in ("", "record", "channel", "kind", "what was found"))
    return (
        "<section id='data'><h2>Problems in the data</h2><div "
        f"class='wide'><table><tr>{head}</tr>{lines}</table></div></section>"
    )


def _not_tried(verdict: Verdict) -> str:
    if not verdict.not_tried:
        return ""
    reasons: dict[str, list[str]] = {}
    for name, why in verdict.not_tried.items():
        reasons.setdefault(why, []).append(spoken(name))
    rows = [[", ".join(names), why] for why, names in reasons.items()]
    return _section("Effects that were not tried", table(("effects", "why"), rows))


def _method(diagnosis: Diagnosis) -> str:
    held = diagnosis.bench.training < len(diagnosis.bench.predictors)
    proof = "the records given for it" if held else "every third stretch of each record"
    steps = (
        "The measured motion is prescribed to the model, which predicts the other channels; controllers "
        "and commands play no part.",
        "The model's own numbers are fitted first, so that nothing is called missing that a better number "
        "explains.",
        "What is left is looked for over time, speed, direction, angle, torque and temperature, and in "
        "orders of the wave generator's turn.",
        "Every effect of the catalogue is simulated in the re-fitted model. Its trace must explain blocks "
        "of time that it has not seen; the best are fitted in full.",
        f"An effect is named only if its share is at least {percent(LEAST_SHARE)}, and fewer than "
        f"{percent(LEVEL)} of 400 repetitions of the whole search on residuals with signs turned at random "
        "do as well: this bounds false alarms of the search, not of one test. The gap is computed on "
        f"{proof}.",
    )
    listed = "".join(f"<li>{html.escape(step)}</li>" for step in steps)
    spent = sum(diagnosis.verdict.seconds.values())
    time = f"<p class='note'>It took {spent:.0f} s.</p>" if spent else ""
    return _section("How it was decided", f"<ol>{listed}</ol>{time}")


def _files(verdict: Verdict, pictures: dict[str, str]) -> str:
    rows = [
        ["report.html", "this page"],
        ["verdict.json", "all of it as data"],
        [
            "compared.mcap",
            "measured, before, re-fit and after over the same times, for Foxglove or Lichtblick",
        ],
        ["diagnose.json", "the layout for it: import it in the viewer"],
        [", ".join(f"{name}.png" for name in pictures), "the figures"],
    ]
    commands = ""
    if verdict.scenario:
        what = "the curve as a table effect" if verdict.curve is not None else "what was found"
        rows.insert(2, [Path(verdict.scenario).name, f"the model with {what}: extends your scenario"])
        commands += f"hdsim run {verdict.scenario}    # the model with what was found\n"
    if verdict.next_experiment is not None and verdict.next_experiment.scenario:
        rows.insert(3, [Path(verdict.next_experiment.scenario).name, "the next experiment"])
        commands += f"hdsim run {verdict.next_experiment.scenario}    # the next experiment\n"
    pre = f"<pre>{html.escape(commands.rstrip())}</pre>" if commands else ""
    return _section("Files, and what to do with them", table(("file", "what it is"), rows) + pre)
