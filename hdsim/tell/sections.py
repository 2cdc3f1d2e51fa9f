"""Sections of the report below the verdict."""

from __future__ import annotations

import html
from collections.abc import Collection
from itertools import zip_longest
from pathlib import Path

from hdsim.diagnosis.name import LEAST_SHARE
from hdsim.diagnosis.rules import RULES
from hdsim.diagnosis.screen import LEVEL
from hdsim.diagnosis.verdict import Verdict
from hdsim.tell.findings import Findings
from hdsim.tell.tables import numbers_table, section, table, with_curve_words
from hdsim.tell.words import (
    FROM_ALL_DATA,
    percent,
    short,
    short_cut_words,
    shown,
    spoken,
    started,
    title_of,
    titles_of,
)


def confusions(verdict: Verdict) -> str:
    """Effects that the data cannot distinguish from the identified ones, and effects that explain a part."""
    body = ""
    for effect in verdict.effects:
        if not effect.indistinguishable_from:
            continue
        own, *others = titles_of(effect)
        lines = ""
        for name, title in zip(effect.indistinguishable_from, others, strict=True):
            rule = effect.separated_by.get(name) or "not recorded"
            lines += f"<li><b>{html.escape(title)}</b>. How they differ: {html.escape(rule)}.</li>"
        body += f"<p>These data cannot distinguish <b>{html.escape(own)}</b> from:</p><ul>{lines}</ul>"
    if verdict.suspects:
        listed = ", ".join(f"{title_of(name)} ({percent(share)})" for name, share in verdict.suspects.items())
        said = "Effects that explain a part of the residual, too little to be identified"
        body += f"<p>{said}: {html.escape(listed)}.</p>"
    title = "Alternatives" if any(one.indistinguishable_from for one in verdict.effects) else "Candidates"
    return section(title, body, "warn") if body else ""


def orders(verdict: Verdict) -> str:
    """The located orders over speed."""
    listed = "".join(f"<li>{html.escape(started(one.sentence))}.</li>" for one in verdict.orders)
    if not listed:
        return ""
    note = (
        "<p class='note'>Amplitudes are means over periods of the order, in bands of speed of each record; "
        "the power of the speed with which they go has its 95 % interval.</p>"
    )
    return f"<p>Orders per turn of the wave generator over speed:</p><ul>{listed}</ul>{note}"


def following(verdict: Verdict) -> str:
    """The next experiment."""
    proposal = verdict.next_experiment
    if proposal is None:
        return ""
    rows = [
        [c.title, _few(c.separation), f"{_few(c.relative)} ×" if c.relative else "-"]
        for c in proposal.considered[:8]
    ]
    body = f"<p><b>{html.escape(proposal.sentence)}</b></p>"
    if proposal.scenario:
        body += (
            f"<p>It is ready as a scenario: <code>{html.escape(Path(proposal.scenario).name)}</code>; "
            f"<code>hdsim run {html.escape(proposal.scenario)}</code> shows what the model predicts.</p>"
        )
    body += (
        "<p class='note'>Discriminability d′: distance between the two candidates that are hardest to "
        "distinguish, in standard deviations of the noise, after each has been fitted to the other. With "
        "d′ = 1 the better fit is the right one in 69 % of cases, with 3 in 93 %. Here "
        f"{_few(proposal.separation)} is expected, {percent(proposal.correct)} of cases, if the noise is the "
        "only unknown.</p>"
    )
    head = ("experiment", "expected d′", "relative to repeating the record")
    return f"<section id='next'><h2>Next experiment</h2>{body}{table(head, rows, (1, 2))}</section>"


def _few(value: float) -> str:
    return f"{value:.0f}" if value >= 9.95 else short(value, 2)


def curve(found: Findings, picture: str) -> str:
    """The unidentified part as a curve: the residual, or what identified effects do not explain of it."""
    curve = found.verdict.curve
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
    named = found.verdict.verdict == "effect"
    checked = f"{percent(curve.share)} of the model's residual (cross-validated over blocks of time)"
    what = f"<b>{html.escape(started(curve.words))}</b>"
    if named:
        part = "A part of the residual"
        if found.unexplained > 0:
            part = f"{percent(found.unexplained)} of the systematic residual of the re-fitted model"
        body = f"<p>{part} does not follow the equation of the identified effect. {what} explains {checked}. "
        body += "The curve is not part of found.yaml, which holds the identified effects alone"
        proved = with_curve_words(found.verdict)
        if found.verdict.scenario_with_curve:
            proved += f", as {Path(found.verdict.scenario_with_curve).name}"
        body += (
            f"; with it held-out residuals are {proved}.</p>"
            if proved
            else ", nor borne out by held-out data.</p>"
        )
    else:
        body = f"<p>{what} explains {checked}.</p>"
    body += (
        picture
        + (f"<p class='note'>Other curves tested: {html.escape(others)}.</p>" if others else "")
        + f"<details><summary>table of the nodes</summary>{table(head, rows, (0, 1, 2))}</details>"
    )
    title = "Residual of the identified effects" if named else "The unidentified effect as a curve"
    return f"<section id='curve'><h2>{title}</h2>{body}</section>"


def fitted(found: Findings) -> str:
    """Parameter estimates of the identified effects and of the model."""
    verdict, body = found.verdict, ""
    for effect, own in zip_longest(verdict.effects, found.settings[: len(verdict.effects)]):
        body += f"<h3>{html.escape(started(effect.title or spoken(effect.name)))} (new)</h3>"
        body += numbers_table(effect.parameters, settings=own)
    if verdict.parameters:
        body += "<h3>Parameters of the model</h3>" + numbers_table(verdict.parameters, verdict.moved)
        body += (
            "<p class='note'>Marked rows: the interval excludes the model's value. Confidence intervals by "
            "the "
            "jackknife over blocks of time, valid for correlated residuals.</p>"
        )
        if verdict.estimated_from == "all":
            body += f"<p class='note'>{FROM_ALL_DATA}</p>"
    return section("Parameter estimates", body) if body else ""


def data(verdict: Verdict) -> str:
    """What the data check found."""
    if not verdict.data_problems:
        return section("The data", "<p>No gap, spike, saturation, wrong unit or wrong sign was found.</p>")
    lines = "".join(
        f"<tr><td class='{html.escape(p.severity)}'>{html.escape(p.severity)}</td>"
        + "".join(f"<td>{html.escape(c)}</td>" for c in (p.record, spoken(p.channel), p.kind, p.message))
        + "</tr>"
        for p in verdict.data_problems
    )
    head = "".join(f"<th>{h}</th>" for h in ("severity", "record", "channel", "kind", "finding"))
    return (
        "<section id='data'><h2>Problems in the data</h2><div "
        f"class='wide'><table><tr>{head}</tr>{lines}</table></div></section>"
    )


def not_tried(verdict: Verdict) -> str:
    """Effects that could not be tested, by reason."""
    if not verdict.not_tried:
        return ""
    reasons: dict[str, list[str]] = {}
    for name, why in verdict.not_tried.items():
        reasons.setdefault(why, []).append(title_of(name))
    rows = [[", ".join(names), why] for why, names in reasons.items()]
    return section("Effects not tested", table(("effects", "reason"), rows))


def method(found: Findings) -> str:
    """How a diagnosis works, in five steps."""
    held = any(run.held for run in found.runs)
    proof = "separate records" if held else "every third stretch of each record"
    steps = (
        "The measured motion is prescribed to the model, which predicts the other channels; controllers "
        "and commands play no part.",
        "The parameters of the model are re-estimated first, so that no effect is reported where a better "
        "parameter value explains the residual.",
        "The residual is regressed on time, speed, direction, angle, torque and temperature, and on the "
        "orders of the wave generator's rotation.",
        "Every effect of the catalogue is simulated in the re-fitted model. Its predicted change must "
        "explain "
        f"left-out blocks of time: at least {percent(LEAST_SHARE)} of the residual, and more than the same "
        f"search finds in all but {percent(LEVEL)} of 400 residuals with random signs (wild bootstrap). The "
        "best are fitted in full.",
        "Each piece of evidence multiplies the odds of an effect; the posterior probability is that the "
        "effect "
        f"is the right one, and it is identified from {percent(RULES.believed)} on (see Why this verdict). "
        f"Validation uses {proof}.",
    )
    listed = "".join(f"<li>{html.escape(step)}</li>" for step in steps)
    spent = sum(found.verdict.seconds.values())
    time = f"<p class='note'>Processor time: {spent:.0f} s.</p>" if spent else ""
    short_cut = found.verdict.short_cut
    cut = f"<p class='note'>{short_cut_words(short_cut)}</p>" if short_cut else ""
    return section("Method", f"<ol>{listed}</ol>{cut}{time}")


def written(verdict: Verdict, pictures: Collection[str]) -> str:
    """The files beside the page."""
    rows = [
        ["report.html", "this page"],
        ["verdict.json", "all results as data"],
        [
            "compared.mcap",
            "measurement and the models before, re-fitted and after, over the same times, for Foxglove or "
            "Lichtblick",
        ],
        ["diagnose.json", "its layout for the viewer"],
        [", ".join(f"{name}.png" for name in pictures), "the figures"],
    ]
    commands = ""
    if verdict.scenario:
        what = "the curve as a table effect" if verdict.verdict == "unknown" else "the result"
        rows.insert(2, [Path(verdict.scenario).name, f"the model with {what}; extends your scenario"])
        commands += f"hdsim run {verdict.scenario}    # the model with the result\n"
    if verdict.scenario_with_curve:
        name = Path(verdict.scenario_with_curve).name
        rows.insert(3, [name, "that model with the curve of the remaining residual"])
    if verdict.next_experiment is not None and verdict.next_experiment.scenario:
        rows.insert(3, [Path(verdict.next_experiment.scenario).name, "the next experiment"])
        commands += f"hdsim run {verdict.next_experiment.scenario}    # the next experiment\n"
    pre = f"<pre>{html.escape(commands.rstrip())}</pre>" if commands else ""
    return section("Files", table(("file", "content"), rows) + pre)
