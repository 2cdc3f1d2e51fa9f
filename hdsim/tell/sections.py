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
from hdsim.tell.tables import numbers_table, section, table
from hdsim.tell.words import percent, short, shown, spoken, started, titles_of


def confusions(verdict: Verdict) -> str:
    """What the data cannot tell from the names, and effects that explain a part."""
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
    return section("Could be confused", body, "warn") if body else ""


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
            f"<code>hdsim run {html.escape(proposal.scenario)}</code> shows what the model expects.</p>"
        )
    body += (
        "<p class='note'>d′ is the distance between the two candidates that are hardest to tell apart, in "
        "standard deviations of the noise, after each has been fitted to the other as well as it can be: 1 "
        "is a guess that is right in 69 % of cases, 3 in 93 %, more is safe. Here "
        f"{_few(proposal.separation)} is expected, which is right in {percent(proposal.correct)} of cases "
        "if the noise is all that is unknown.</p>"
    )
    head = ("experiment", "expected d′", "against repeating the record")
    return f"<section id='next'><h2>What to measure next</h2>{body}{table(head, rows, (1, 2))}</section>"


def _few(value: float) -> str:
    return f"{value:.0f}" if value >= 9.95 else short(value, 2)


def curve(found: Findings, picture: str) -> str:
    """What has no name as a curve: all of it, or what the names leave."""
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
    checked = (
        f"{percent(curve.share)} of what the model leaves (checked on blocks of time left out of the fit)"
    )
    what = f"<b>{html.escape(started(curve.words))}</b>"
    if named:
        part = "A part of it"
        if found.unexplained > 0:
            part = f"{percent(found.unexplained)} of it (of the structure that the re-fitted model left)"
        body = f"<p>{part} follows another shape than the named law. {what} explains {checked}. The curve is "
        body += "shown only: found.yaml holds the named effects without it.</p>"
    else:
        body = f"<p>{what} explains {checked}.</p>"
    body += (
        picture
        + (f"<p class='note'>Other curves that were tried: {html.escape(others)}.</p>" if others else "")
        + f"<details><summary>its corners as numbers</summary>{table(head, rows, (0, 1, 2))}</details>"
    )
    title = "What the named effects leave" if named else "The curve that is missing"
    return f"<section id='curve'><h2>{title}</h2>{body}</section>"


def fitted(found: Findings) -> str:
    """Fitted numbers of the named effects and of the model."""
    verdict, body = found.verdict, ""
    for effect, own in zip_longest(verdict.effects, found.settings[: len(verdict.effects)]):
        body += f"<h3>{html.escape(started(effect.title or spoken(effect.name)))} (new)</h3>"
        body += numbers_table(effect.parameters, settings=own)
    if verdict.parameters:
        body += "<h3>The model's own numbers</h3>" + numbers_table(verdict.parameters, verdict.moved)
        body += (
            "<p class='note'>Marked at the left: the model's number lies outside the interval. Intervals "
            "come from the spread over blocks of time, not from the noise alone.</p>"
        )
    return section("Fitted numbers", body) if body else ""


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
    head = "".join(f"<th>{h}</th>" for h in ("", "record", "channel", "kind", "what was found"))
    return (
        "<section id='data'><h2>Problems in the data</h2><div "
        f"class='wide'><table><tr>{head}</tr>{lines}</table></div></section>"
    )


def not_tried(verdict: Verdict) -> str:
    """Effects that could not be tried, by reason."""
    if not verdict.not_tried:
        return ""
    reasons: dict[str, list[str]] = {}
    for name, why in verdict.not_tried.items():
        reasons.setdefault(why, []).append(spoken(name))
    rows = [[", ".join(names), why] for why, names in reasons.items()]
    return section("Effects that were not tried", table(("effects", "why"), rows))


def method(found: Findings) -> str:
    """How a diagnosis works, in five steps."""
    held = any(run.held for run in found.runs)
    proof = "the records given for it" if held else "every third stretch of each record"
    steps = (
        "The measured motion is prescribed to the model, which predicts the other channels; controllers "
        "and commands play no part.",
        "The model's own numbers are fitted first, so that nothing is called missing that a better number "
        "explains.",
        "What is left is looked for over time, speed, direction, angle, torque and temperature, and in "
        "orders of the wave generator's turn.",
        "Every effect of the catalogue is simulated in the re-fitted model. Its trace must explain blocks "
        f"of time that it has not seen: at least {percent(LEAST_SHARE)} of what is left, and more than the "
        f"same search finds in all but {percent(LEVEL)} of 400 residuals with signs turned at random. The "
        "best are fitted in full.",
        "All of it is evidence. Each piece makes a name more or less likely; the odds multiply to the "
        f"probability that the name is right, and a name is given from {percent(RULES.believed)} on (see Why "
        f"this verdict). The gap is computed on {proof}.",
    )
    listed = "".join(f"<li>{html.escape(step)}</li>" for step in steps)
    spent = sum(found.verdict.seconds.values())
    time = f"<p class='note'>It took {spent:.0f} s.</p>" if spent else ""
    return section("How it was decided", f"<ol>{listed}</ol>{time}")


def written(verdict: Verdict, pictures: Collection[str]) -> str:
    """The files beside the page."""
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
        what = "the curve as a table effect" if verdict.verdict == "unknown" else "what was found"
        rows.insert(2, [Path(verdict.scenario).name, f"the model with {what}: extends your scenario"])
        commands += f"hdsim run {verdict.scenario}    # the model with what was found\n"
    if verdict.next_experiment is not None and verdict.next_experiment.scenario:
        rows.insert(3, [Path(verdict.next_experiment.scenario).name, "the next experiment"])
        commands += f"hdsim run {verdict.next_experiment.scenario}    # the next experiment\n"
    pre = f"<pre>{html.escape(commands.rstrip())}</pre>" if commands else ""
    return section("Files, and what to do with them", table(("file", "what it is"), rows) + pre)
