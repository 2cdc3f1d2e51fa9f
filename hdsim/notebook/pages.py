"""What a notebook shows of an object: numbers and a picture, as HTML that stands alone."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from hdsim.plot import units
from hdsim.recording import Column, Recording, Table
from hdsim.tell.tables import GAP_HEAD, gap_rows, numbers_table, table
from hdsim.tell.words import shown, spoken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hdsim.diagnosis.workflow import Diagnosis
    from hdsim.estimate.estimation import Estimation
    from hdsim.plot.units import Unit
    from hdsim.recording import Array
    from hdsim.scenario import Scenario
    from hdsim.studies.engine.study import StudyResult

#: Dots an inch of the pictures: a strip of 11 inches is as wide as a notebook's cell.
DPI = 90
#: Rows of a study's summary, and events of a run, that are shown.
MOST_ROWS = 20
#: Samples of what a scenario commands.
SAMPLES = 1500
#: Channels whose sizes are shown of a run, as far as there are.
CHANNELS = (
    "output_angle",
    "output_velocity",
    "motor_velocity",
    "motor_torque",
    "output_torque",
    "load_torque",
    "transmission_error",
    "tracking_error",
    "temperature",
)


def scenario_html(scenario: Scenario) -> str:
    """What a scenario describes, and what it commands over time."""
    lines = scenario.about()
    title = lines.pop("scenario")
    name, _, about = title.partition(": ")
    return _card(name or "scenario", about, lines, strip(commanded(scenario)))


def recording_html(recording: Recording) -> str:
    """A run: its sizes, what happened, and its first panels."""
    from hdsim.plot import origin

    facts = {
        "tables": ", ".join(f"{name} ({len(one)} samples)" for name, one in recording.tables.items()),
        "channels": ", ".join(recording),
    }
    if "state" in recording.tables and len(recording.time):
        facts["time"] = f"{shown(float(recording.time[0]))} to {shown(float(recording.time[-1]))} s"
    residual = recording.metadata.get("energy_residual_relative")
    if residual is not None:
        facts["energy residual"] = f"{residual} of what was exchanged"
    told = [event for event in recording.events if event.level != "info"]
    rows = [[f"{event.time:.4g} s", event.level, event.message] for event in told[:MOST_ROWS]]
    events = table(("when", "", "what"), rows) if rows else ""
    described = origin.subtitle(recording).replace("\n", " · ")
    trouble = origin.trouble(recording)
    warning = f"<p class='trouble'>{html.escape(trouble)}</p>" if trouble else ""
    sizes = table(("channel", "unit", "least", "largest", "rms"), _sizes(recording), range(2, 5))
    body = warning + sizes + events
    return _card(origin.title(recording), described, facts, strip(recording), body)


def study_html(result: StudyResult) -> str:
    """A study: means and quantiles of its metrics, and its first picture."""
    from hdsim.errors import InputError
    from hdsim.studies.engine.plots import study_figures, words
    from hdsim.studies.engine.sensitivity import indices, is_sensitivity
    from hdsim.studies.engine.summary import summarise

    plan, found = result.plan, result.table
    failed = found.columns["status"].values.count("failed")
    facts = {
        "runs": f"{len(found)}" + (f", {failed} of them failed" if failed else ""),
        "varied": ", ".join(plan.study.parameters) or "tooth surfaces and noise only",
        "metrics": ", ".join(plan.study.metrics),
    }
    summaries = summarise(plan, found)
    rows = []
    for one in summaries[:MOST_ROWS]:
        many = one.runs > 1
        rows.append(
            [
                spoken(one.metric),
                words(one.point),
                units.printed(one.unit),
                str(one.runs),
                shown(one.mean.value),
                f"{shown(one.mean.low)} to {shown(one.mean.high)}" if many else "",
                f"{shown(one.low)} to {shown(one.high.value)}" if many else "",
            ]
        )
    head = ["metric", "at", "unit", "runs", "mean"]
    if any(one.runs > 1 for one in summaries[:MOST_ROWS]):
        head += [f"{100 * plan.study.confidence:g} % interval", "5 % to 95 %"]
    body = table(head, [row[: len(head)] for row in rows], (3, 4))
    if len(summaries) > MOST_ROWS:
        body += f"<p>and {len(summaries) - MOST_ROWS} more</p>"
    try:
        sensitivities = indices(plan, found) if is_sensitivity(plan.study) else []
    except InputError as error:
        sensitivities = []
        body += f"<p class='trouble'>{html.escape(str(error))}</p>"
    figures = study_figures(plan, found, summaries, sensitivities)
    about = plan.study.description.strip().split("\n")[0]
    return _card(plan.study.name or "study", about, facts, next(iter(figures.values()), None), body)


def diagnosis_html(diagnosis: Diagnosis) -> str:
    """A diagnosis: verdict, confidence, parameter estimates, and the residuals on held-out data."""
    from hdsim.tell.figures import gap_bars, gap_figure
    from hdsim.tell.findings import gather
    from hdsim.tell.wording import KINDS, headline, sureness

    found = gather(diagnosis)
    verdict = found.verdict
    sure = sureness(found)
    facts = {"confidence": sure.sentence}
    serious = [f"{p.record}: {p.channel} {p.message}" for p in verdict.data_problems if p.severity != "info"]
    if serious:
        facts["data"] = "; ".join(serious)
    parts = [
        f"<h4>{html.escape(effect.title or spoken(effect.name))}</h4>"
        + numbers_table(effect.parameters, (), effect.settings)
        for effect in verdict.effects
    ]
    moved = {name: number for name, number in verdict.parameters.items() if name in verdict.moved}
    if moved:
        parts.append("<h4>parameters of the model that are wrong</h4>" + numbers_table(moved, list(moved)))
    if verdict.gap:
        parts.append("<h4>RMS residual on held-out data</h4>")
        parts.append(table(GAP_HEAD, gap_rows(verdict), range(2, len(GAP_HEAD))))
    figure = gap_figure(verdict, gap_bars(found))
    return _card(headline(found), KINDS[verdict.verdict], facts, figure, "".join(parts))


def fit_html(found: Estimation) -> str:
    """A fit: every parameter estimate with its interval, and the residuals on held-out data."""
    from hdsim.estimate.outcome import result_of
    from hdsim.tell import fit_report
    from hdsim.tell.fit_figures import intervals_figure

    result = result_of(found)
    facts = {"records": ", ".join(one.record + " (held out)" * one.holdout for one in result.records)}
    serious = [f"{p.record}: {p.channel} {p.message}" for p in result.data_problems if p.severity != "info"]
    if serious:
        facts["data"] = "; ".join(serious)
    body = numbers_table(result.numbers, result.moved)
    rows = fit_report.gap_rows(result)
    if rows:
        body += "<h4>RMS residual on held-out data</h4>"
        body += table(fit_report.GAP_HEAD, rows, range(2, len(fit_report.GAP_HEAD)))
    return _card("Fit", fit_report.summary(result), facts, intervals_figure(found), body)


def commanded(scenario: Scenario) -> Recording:
    """What a scenario asks for over time, as channels of a run that has not been made."""
    from hdsim.actuation.command import TorqueCommand

    command, ratio = scenario.command, scenario.drive.ratio
    signals = {}
    reference = command.reference(ratio)
    if reference is not None:
        signals["reference_angle"] = reference
    for motion in command.motions(ratio):
        signals[f"{motion.axis}_angle"] = motion.signal
    if isinstance(command.motor, TorqueCommand):
        signals["motor_torque"] = command.motor.torque.data
    if scenario.load.torque is not None:
        signals["load_torque"] = scenario.load.torque.data
    time = np.linspace(0.0, scenario.run.duration_s, SAMPLES)
    columns = {}
    for name, signal in signals.items():
        values = signal.values(time)[0]
        columns[name] = Column(values, "N m" if name.endswith("torque") else "rad")
    if "motor_angle" in columns and "output_angle" not in columns:
        columns["output_angle"] = Column(columns["motor_angle"].values / ratio, "rad")
    return Recording({"state": Table(time, columns)}, metadata={"scenario": scenario.to_yaml()})


def strip(recording: Recording) -> Figure | None:
    """The first panels of a run side by side; None where there is nothing to draw."""
    from hdsim.errors import InputError
    from hdsim.plot import plot_strip

    try:
        return plot_strip(recording)
    except InputError:
        return None


def _sizes(recording: Recording) -> list[list[str]]:
    """Least and largest value and rms of the main channels that are not zero throughout."""
    rows = []
    for name in CHANNELS if "state" in recording.tables else ():
        if name not in recording:
            continue
        values = recording[name][np.isfinite(recording[name])]
        if not len(values) or not values.any():
            continue
        unit = _readable(name, recording.unit(name), values)
        numbers = (values.min(), values.max(), np.sqrt(np.mean(values**2)))
        rows.append([spoken(name), unit.name, *(shown(unit.factor * float(number)) for number in numbers)])
    return rows


def _readable(name: str, unit: str, values: Array) -> Unit:
    """The unit in which an engineer reads a channel."""
    size = units.largest(values)
    if unit == "rad":
        return units.for_error(size) if name.endswith("error") else units.for_angle(size)
    if unit == "rad/s":
        return units.RPM
    return units.for_torque(size) if unit == "N m" else units.Unit(unit, 1.0)


def _card(title: str, about: str, facts: Mapping[str, str], picture: Figure | None, body: str = "") -> str:
    """One object as HTML that needs nothing from elsewhere; plain text is escaped, ``body`` is HTML."""
    css = files("hdsim.notebook").joinpath("card.css").read_text(encoding="utf-8")
    parts = [f"<div class='hdsim'><style>{css}</style><h3>{html.escape(title)}</h3>"]
    if about:
        parts.append(f"<p>{html.escape(about)}</p>")
    parts.append(_facts(facts))
    parts.append(body)
    if picture is not None:
        parts.append(f"<img alt='{html.escape(title)}' src='data:image/png;base64,{_png(picture)}'>")
    parts.append("</div>")
    return "".join(parts)


def _facts(facts: Mapping[str, str]) -> str:
    lines: Sequence[str] = [
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(text)}</td></tr>" for name, text in facts.items()
    ]
    return f"<table class='facts'>{''.join(lines)}</table>" if lines else ""


def _png(figure: Figure) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    return base64.b64encode(stream.getvalue()).decode()
