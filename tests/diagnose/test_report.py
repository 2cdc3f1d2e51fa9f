"""The report: what it says, that it needs nothing else, and what lies beside it."""

import html
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from diagnose_bench import rigid_record, scenario
from rich.console import Console

import hdsim
from hdsim.diagnose.further import Candidate, CurveFound, NextExperiment
from hdsim.diagnose.locate import Place
from hdsim.diagnose.verdict import NamedEffect, Verdict
from hdsim.diagnose.workflow import Diagnosis, diagnose
from hdsim.estimate.found import DataProblem, FittedNumber
from hdsim.log import read_attachments
from hdsim.log.info import info_log
from hdsim.log.layout import split_path
from hdsim.tell.figures import worst_stretch
from hdsim.tell.figures_where import LABELS, located_figure
from hdsim.tell.following import NOTHING, candidates
from hdsim.tell.report import write_report
from hdsim.tell.save import save
from hdsim.tell.terminal import Progress, show
from hdsim.tell.wording import farthest, headline, named_number, shown, sureness, unit_of

NASTY = "<script>alert('x')</script> & co"


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    folder = tmp_path_factory.mktemp("base")
    scenario(folder)
    return folder / "rigid.yaml"


@pytest.fixture(scope="module")
def found(base) -> Diagnosis:
    """A motor with cogging of order 4 that the model does not have."""
    record = rigid_record(6.0, extra=lambda angle, _: 0.02 * np.sin(4 * angle + 0.3), seed=3)
    record.name = NASTY
    return diagnose([record], hdsim.load_scenario(base))


@pytest.fixture(scope="module")
def out(found, base, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out")
    save(found, base, folder)
    return folder


def page(found: Diagnosis, folder, **changes) -> str:
    verdict = found.verdict.model_copy(update=changes)
    return write_report(replace(found, verdict=verdict), folder).read_text(encoding="utf-8")


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
    said = [headline(verdict), sureness(found).words, sureness(found).number]
    places = [body.index(html.escape(line)) for line in said]
    assert places == sorted(places)
    assert places[-1] < body.index("How far off the model is")
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


def test_alternatives_stand_side_by_side_with_what_separates_them(found, tmp_path):
    effect = NamedEffect(
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
    text = page(found, tmp_path, effects=[effect], next_experiment=proposal)
    first = text[: text.index("How far off the model is")]
    assert "Maxwell slip) or torsional hysteresis (Duhem) (these data cannot tell which)" in first
    assert "Fairly sure that it is one of these, not which" in first
    assert "70\u00a0%" in first
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
    text = page(
        found, tmp_path, verdict="unknown", effects=[], curve=curve, suspects={"unbalance": 0.3},
        scenario="out/found.yaml",
    )  # fmt: skip
    assert "Sure that something is missing, not what" in text
    assert "<td class='n'>-0.125</td><td class='n'>-0.2 to -0.05</td>" in text
    assert "torque on the motor over time (10\u00a0%)" in text
    assert "unbalance (30\u00a0%)" in text
    assert "the curve as a table effect" in text
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")


def test_moved_and_undetermined_numbers_say_so(found, tmp_path):
    numbers = {
        "drive.friction.coulomb_nm": FittedNumber(value=0.045, interval=(0.044, 0.046), start=0.03),
        "drive.inertia.motor_kg_m2": FittedNumber(value=5e-5, start=5e-5, tied_to=["load.inertia_kg_m2"]),
    }
    problem = DataProblem(
        record="a", channel="motor_torque", kind="spikes", severity="warning", message="3 <spikes>"
    )
    text = page(
        found, tmp_path, verdict="parameter", effects=[], parameters=numbers,
        moved=["drive.friction.coulomb_nm"], data_problems=[problem], not_tried={"unbalance": "no <gravity>"},
    )  # fmt: skip
    assert "one number of the model is off: friction, coulomb 0.045 instead of 0.03 N m" in text
    assert "<tr class='moved'><td>friction, coulomb" in text
    assert "+50.0 %" in text
    assert "not determined by these data: cannot be told from load, inertia" in text
    assert "3 &lt;spikes&gt;" in text
    assert "1 problem in the data" in text
    assert "no &lt;gravity&gt;" in text


def test_how_far_a_number_moved_is_in_standard_errors_of_its_logarithm(found):
    width = 0.02  # standard deviation of the logarithm
    bounds = (0.04 * np.exp(-2 * width), 0.04 * np.exp(2 * width))
    number = FittedNumber(value=0.04, interval=bounds, start=0.04 * np.exp(-5 * width))
    verdict = found.verdict.model_copy(update={"parameters": {"x": number}, "moved": ["x"]})
    assert farthest(verdict) == pytest.approx(5.0)


def test_a_number_that_is_off_is_said_though_no_interval_excludes_it(tmp_path):
    # All that the motor feels a third larger: inertia, friction, or simply the torque constant.
    total = 6.93e-5 + 0.50002 / 1e4
    record = rigid_record(8.0, inertia=1.3 * total, coulomb=0.039, viscous=4.55e-4)
    found = diagnose([record], scenario(tmp_path))
    assert found.verdict.verdict == "parameter"
    assert found.verdict.moved == ["motor_torque_gain"]
    said = headline(found.verdict)
    assert "most simply motor torque gain" in said
    sure = sureness(found)
    assert "not which" in sure.words
    fall = found.verdict.gap["motor_torque"]
    assert f"{100 * fall.refit / fall.before:.0f}" in sure.number


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (16000.0, "16000"),
        (0.0245, "0.0245"),
        (5.198e-05, "5.198e-5"),
        (-126.44, "-126.4"),
        (2e7, "2e7"),
    ],
)
def test_numbers_are_shown_without_needless_exponents(value, text):
    assert shown(value) == text
    assert float(text) == pytest.approx(value, rel=1e-3)


def test_paths_become_words_and_units():
    assert named_number("drive.torsion.damping_nm_s_per_rad") == ("torsion, damping", "N m s/rad")
    components = {"components": [{"order": 2, "per": "output_turn"}]}
    assert named_number("components.0.amplitude_arcmin", components) == (
        "order 2 per output turn, amplitude",
        "arcmin",
    )
    assert named_number("curves.1.values_nm") == ("curves, no. 2, values", "N m")


def test_the_stretch_shown_closely_is_the_worst_of_the_held_out_ones():
    time = np.arange(9000) / 1000.0
    hold = (np.arange(9000) // 1000) % 3 == 2
    off = np.ones(9000)
    off[500:600] = 50.0  # worse, but the fits have seen it
    off[5300:5400] = 5.0
    stretch = worst_stretch(time, [np.where(hold, off, 0.0)], hold)
    assert stretch.start <= 5300
    assert stretch.stop >= 5400
    assert hold[stretch].all()
    assert stretch.stop - stretch.start <= 900


def test_the_terminal_shows_verdict_and_gaps_in_80_columns(found):
    terminal = Console(width=80, record=True, force_terminal=True, quiet=False, file=open("/dev/null", "w"))  # noqa: SIM115
    show(found, terminal)
    lines = terminal.export_text().splitlines()
    assert max(map(len, lines)) <= 80
    text = "\n".join(lines)
    assert headline(found.verdict) in " ".join(text.split())
    gap = found.verdict.gap["motor_torque"]
    row = next(line for line in lines if line.strip().startswith("motor torque ("))
    for value in (gap.before, gap.refit, gap.after, gap.noise):
        assert f"{unit_of(gap).factor * value:.3g}" in row.split()


def test_the_bar_never_goes_back_and_is_silent_off_a_terminal(capsys):
    with Progress(Console(stderr=True, force_terminal=False)) as tell:
        tell("locating")
    assert capsys.readouterr() == ("", "")
    bar = Progress(Console(stderr=True, force_terminal=True))
    with bar as tell:
        done = []
        for text in ("checking the data", "screening the catalogue", "locating what is left", "[odd] detail"):
            tell(text)
            done.append(bar._done)
    assert done == sorted(done)
    assert done[-1] == 40


def test_nothing_is_said_with_what_is_left(found, tmp_path):
    gap = {
        name: one.model_copy(update={"after": 1.25 * one.noise}) for name, one in found.verdict.gap.items()
    }
    text = page(found, tmp_path, verdict="nothing", effects=[], gap=gap, sentence="Nothing is lacking.")
    assert "Nothing is lacking." in text
    assert "1.2 times the noise is left" in text
    assert "may still be there" in text


def labels(figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_the_spectrum_names_its_peak_and_what_these_turns_cannot_tell_from_it(found):
    figure = located_figure(found)
    assert any(axes.get_xlabel() == "order: periods per wave-generator turn" for axes in figure.axes)
    # The flexspline has 200 teeth, the circular spline 202: 4 turns of one are 4.04 against the other.
    assert any(re.fullmatch(r"4(/4\.04)?", label) for label in labels(figure))


@pytest.mark.parametrize("coordinate", list(LABELS))
def test_every_coordinate_has_a_picture(found, coordinate):
    if coordinate in ("torque", "temperature"):
        pytest.skip("the bench has no such channel")
    places = [Place(coordinate, "motor_torque", 0.5), Place("direction", "motor_torque", 0.1)]
    location = replace(found.stages[0].location, places=places)
    figure = located_figure(replace(found, stages=[replace(found.stages[0], location=location)]))
    assert len(figure.axes) == 2
    assert figure.axes[1].get_title(loc="left").startswith("motor torque: 50 %")
    assert figure.axes[1].lines
    assert figure.axes[1].get_xlabel()
    figure.draw_without_rendering()


def test_a_group_gets_its_next_experiment_as_a_scenario_that_runs(found, base, tmp_path):
    own = replace(
        found.named[0], group={"stribeck_friction": 0.99}, alternatives={"stribeck_friction": found.refit.fit}
    )
    effect = found.verdict.effects[0].model_copy(update={"indistinguishable_from": ["stribeck_friction"]})
    verdict = found.verdict.model_copy(update={"effects": [effect]})
    report = save(replace(found, named=[own], verdict=verdict), base, tmp_path).read_text(encoding="utf-8")
    kept = Verdict.model_validate_json((tmp_path / "verdict.json").read_text(encoding="utf-8"))
    proposal = kept.next_experiment
    assert proposal.between == ["motor_torque_ripple", "stribeck_friction"]
    assert proposal.scenario == str(tmp_path / "next.yaml")
    assert html.escape(proposal.sentence) in report
    assert hdsim.load_scenario(proposal.scenario).run.duration_s > 0
    assert proposal.considered[0].separation == max(c.separation for c in proposal.considered)


def test_only_what_the_data_leave_open_is_to_be_measured_again(found):
    own = found.named[0]
    assert candidates(found) == {}
    weak = replace(own, confidence=0.6)
    assert candidates(replace(found, named=[weak])) == {own.name: own.fit, NOTHING: found.refit.fit}
    silent = found.verdict.model_copy(update={"verdict": "nothing"})
    assert candidates(replace(found, named=[weak], verdict=silent)) == {}
