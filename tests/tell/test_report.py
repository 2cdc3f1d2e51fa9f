"""The report: what it says, that it needs nothing else, and what lies beside it."""

import html
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario
from telling import NASTY, page

import hdsim
from hdsim.diagnosis.further import Candidate, CurveFound, NextExperiment
from hdsim.diagnosis.verdict import IdentifiedEffect
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.found import DataProblem, ParameterEstimate
from hdsim.log import read_attachments
from hdsim.log.info import info_log
from hdsim.log.layout import split_path
from hdsim.tell.findings import Findings, gather
from hdsim.tell.wording import headline, sureness
from hdsim.tell.words import shown, unit_of


def changed(found: Findings, folder: Path, **changes) -> str:
    """The report of a changed verdict."""
    return page(replace(found, verdict=found.verdict.model_copy(update=changes)), folder)


class Loads(HTMLParser):
    """What a browser would fetch for a page, and whether its tags are closed in turn."""

    def __init__(self) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.open: list[str] = []
        self.scripts = 0

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.sources += [given[name] for name in ("src", "srcset", "data", "poster") if given.get(name)]
        if tag == "link":
            self.sources.append(given.get("href", ""))
        self.scripts += tag == "script"
        if tag not in ("meta", "img", "br", "link"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_says_what_is_missing_how_sure_it_is_and_what_it_gains(found, out):
    text = (out / "report.html").read_text(encoding="utf-8")
    verdict = found.verdict
    assert verdict.verdict == "effect"
    assert verdict.effects[0].name == "motor_torque_ripple"
    assert html.escape(verdict.sentence) in text
    body = text[text.index("<body>") :]
    said = [headline(found), sureness(found).words, sureness(found).number]
    places = [body.index(html.escape(line)) for line in said]
    assert places == sorted(places)
    assert places[-1] < body.index("RMS residual on held-out data")
    for gap in verdict.gap.values():
        unit = unit_of(gap)
        for value in (gap.before, gap.refit, gap.after, gap.noise):
            assert f"<td class='n'>{unit.factor * value:.3g}</td>" in body
        assert f"<td>{unit.name}</td>" in body


def test_the_fitted_harmonic_is_called_by_its_order(found, out):
    text = (out / "report.html").read_text(encoding="utf-8")
    effect = found.verdict.effects[0]
    path = next(name for name in effect.parameters if name.endswith("cogging_nm"))
    assert re.search(r"order 4\b[^<]*, cogging<code>" + re.escape(path), text)
    assert effect.parameters[path].value == pytest.approx(0.02, rel=0.05)
    assert shown(effect.parameters[path].value) in text


def test_the_page_needs_no_other_file_and_escapes_names(out):
    text = (out / "report.html").read_text(encoding="utf-8")
    loads = Loads()
    loads.feed(text)
    assert not loads.open
    assert loads.scripts == 0
    assert len(loads.sources) == 4
    assert all(source.startswith("data:image/png;base64,") for source in loads.sources)
    assert "url(" not in text
    assert "@import" not in text
    assert NASTY not in text
    assert html.escape(NASTY) in text


def test_every_figure_is_there_as_png_too(out):
    for name in ("gap", "located", "traces", "whole"):
        content = (out / f"{name}.png").read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) > 10_000


def test_the_log_holds_all_runs_and_its_layout_shows_only_what_is_there(found, out):
    about = info_log(out / "compared.mcap")
    log = hdsim.open_log(out / "compared.mcap")
    assert {"measured", "before", "refit", "after"} <= set(log.tables)
    left = log.tables["after"]["motor_torque_error"]
    measured, model = (log.tables[name]["motor_torque"] for name in ("measured", "after"))
    assert np.allclose(left, measured - model, equal_nan=True)
    assert np.nanstd(left) < 0.5 * np.nanstd(log.tables["before"]["motor_torque_error"])

    text = (out / "diagnose.json").read_text(encoding="utf-8")
    attached = read_attachments(out / "compared.mcap")["layout-diagnose.json"]
    assert json.loads(text) == json.loads(attached)
    paths = re.findall(r'"value": "(/hd/[^"]+)"', text)
    assert {split_path(path)[0] for path in paths} >= {
        f"/hd/{n}_view" for n in ("measured", "before", "after")
    }
    for path in paths:
        topic, field = split_path(path)
        assert field in about.fields[topic], path
    # The verdict, the effect by its name, and the trace of the re-fit are in the log and in the layout.
    built = json.loads(text)["configById"]
    assert log.events[0].message == found.verdict.sentence
    (named,) = (event for event in log.events if event.source == "effect")
    assert named.message.startswith("motor_torque_ripple")
    (verdict,) = (panel for id, panel in built.items() if id.startswith("Indicator!"))
    assert verdict["fallbackLabel"] == found.verdict.effects[0].title
    assert "/hd/refit_view.motor_torque" in paths
    assert {"RosOut!events", "3D!measured_and_modelled"} <= set(built)


def test_alternatives_stand_side_by_side_with_what_separates_them(found, tmp_path):
    effect = IdentifiedEffect(
        name="torsional_hysteresis_maxwell", title="torsional hysteresis (Maxwell slip)",
        confidence=0.7, chance=0.01, explained=0.5,
        indistinguishable_from=["torsional_hysteresis_duhem"],
        separated_by={"torsional_hysteresis_duhem": "compare <minor> loops"},
    )  # fmt: skip
    proposal = NextExperiment(
        sentence="To tell them apart: creep.", between=["a", "b"], separation=3.0, repeated=1.5, correct=0.93,
        considered=[Candidate(title="creep to and fro", separation=3.0, relative=2.0)],
        scenario="out/next.yaml",
    )  # fmt: skip
    text = changed(found, tmp_path, effects=[effect], next_experiment=proposal)
    first = text[: text.index("RMS residual on held-out data")]
    assert "Maxwell slip) or torsional hysteresis (Duhem) (not distinguishable with these data)" in first
    assert "Fairly sure that it is one of these, not which" in first
    assert "7 in 10 of such verdicts are right" in first
    assert "compare &lt;minor&gt; loops" in text
    assert "To tell them apart: creep." in text
    assert "<td>creep to and fro</td><td class='n'>3</td><td class='n'>2 ×</td>" in text
    assert "hdsim run out/next.yaml" in text
    assert "93\u00a0% of cases" in text


def test_what_has_no_name_is_shown_as_a_curve_with_intervals(found, tmp_path):
    curve = CurveFound(
        words="torque on the output over output angle", coordinate="output_angle", coordinate_unit="rad",
        acts_on="output_torque", at=[-1.0, 0.0, 1.5], values=[0.25, -0.125, 0.75],
        intervals=[(0.2, 0.3), (-0.2, -0.05), (0.5, 1.0)], unit="N m", share=0.4,
        tried={"torque on the output over output angle": 0.4, "torque on the motor over time": 0.1},
    )  # fmt: skip
    text = changed(
        found, tmp_path, verdict="unknown", effects=[], curve=curve, suspects={"unbalance": 0.3},
        scenario="out/found.yaml",
    )  # fmt: skip
    assert "something is missing" in text
    assert "<td class='n'>-0.125</td><td class='n'>-0.2 to -0.05</td>" in text
    assert "torque on the motor over time (10\u00a0%)" in text
    assert "unbalance (30\u00a0%)" in text
    assert "the curve as a table effect" in text
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")


def test_moved_and_undetermined_numbers_say_so(found, tmp_path):
    numbers = {
        "drive.friction.coulomb_nm": ParameterEstimate(value=0.045, interval=(0.044, 0.046), start=0.03),
        "drive.inertia.motor_kg_m2": ParameterEstimate(
            value=5e-5, start=5e-5, tied_to=["load.inertia_kg_m2"]
        ),
    }
    problem = DataProblem(
        record="a", channel="motor_torque", kind="spikes", severity="warning", message="3 <spikes>"
    )
    text = changed(
        found, tmp_path, verdict="parameter", effects=[], parameters=numbers,
        moved=["drive.friction.coulomb_nm"], data_problems=[problem], not_tried={"unbalance": "no <gravity>"},
    )  # fmt: skip
    assert "one parameter of the model is wrong: Coulomb friction 0.045 instead of 0.03 N m" in text
    assert "<tr class='moved'><td>Coulomb friction" in text
    assert "+50.0 %" in text
    assert "not identifiable from these data: confounded with load inertia" in text
    assert "3 &lt;spikes&gt;" in text
    assert "1 problem in the data" in text
    assert "no &lt;gravity&gt;" in text


def test_a_number_that_is_off_is_said_though_no_interval_excludes_it(tmp_path):
    # All that the motor feels a third larger: inertia, friction, or simply the torque constant.
    total = 6.93e-5 + 0.50002 / 1e4
    record = rigid_record(8.0, inertia=1.3 * total, coulomb=0.039, viscous=4.55e-4)
    diagnosis = diagnose([record], scenario(tmp_path))
    found = gather(diagnosis)
    assert found.verdict.verdict == "parameter"
    assert found.verdict.moved == ["motor_torque_gain"]
    said = headline(found)
    assert "most simply motor torque gain" in said
    sure = sureness(found)
    assert "not which" in sure.words
    fall = found.verdict.gap["motor_torque"]
    assert f"{100 * fall.refit / fall.before:.0f}" in sure.number
