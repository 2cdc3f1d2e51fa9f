import json

import pytest
from click.testing import CliRunner

from hdsim.errors import InputError
from hdsim.reproduce import paper
from hdsim.reproduce.commands import reproduce
from hdsim.reproduce.report import to_html, to_markdown, write
from hdsim.reproduce.rows import Verdict, compute, names

QUICK = [n for n in names() if not n.startswith(("round-trip", "boundary"))]


@pytest.fixture(scope="module")
def rows():
    return {row.name: row for row in compute(QUICK)}


def test_every_equation_table_and_figure_has_a_row():
    known = names()
    assert len(known) == len(set(known))
    for number in [*range(1, 19), 21]:
        assert f"eq-{number}" in known
    assert sum(n.startswith("table-4-") for n in known) == 8
    for name in (
        "fig-8",
        "fig-9",
        "fig-10a",
        "fig-10b",
        "fig-11-linearity",
        "rule-D",
        "rule-G",
        "equivalent-pair",
    ):
        assert name in known


def test_each_name_gives_its_row(rows):
    assert list(rows) == QUICK
    for row in rows.values():
        assert row.reason
        assert row.computed
        assert isinstance(row.verdict, Verdict)


def test_the_verdicts_that_anyone_can_check_by_hand(rows):
    assert rows["eq-21"].values["as_printed_n"] == pytest.approx(52 / (60 * 0.05))
    assert rows["eq-21"].values["corrected_n"] == pytest.approx(34.67, abs=0.005)
    assert rows["eq-21"].verdict == Verdict.CONTRADICTED
    assert rows["equivalent-pair"].values["mean_D"] == pytest.approx((2.4272 + 2.643) / 2)


def test_table_4_within_7_percent(rows):
    cells = [rows[n] for n in rows if n.startswith("table-4-")]
    assert sum(r.verdict == Verdict.REPRODUCED for r in cells) == 7
    assert sum(r.verdict == Verdict.OPEN for r in cells) == 1
    assert all(abs(r.values.get("relative_error", 0.0)) < 0.07 for r in cells)


def test_the_stiffness_level(rows):
    assert rows["stiffness-averaged"].values["at_low_hardness_n_per_m"] > 10 * paper.STIFFNESS_N_PER_M
    assert 2.5e9 < rows["stiffness-summed"].values["hardness_of_6e7_pa"] < 2.8e9


def test_figure_10_has_no_step_of_the_claimed_sign(rows):
    for name in ("fig-10a", "fig-10b"):
        assert rows[name].values["steps_with_claimed_sign"] == 0
        assert rows[name].values["steps"] > 100
        assert rows[name].verdict == Verdict.CONTRADICTED


def test_eq_10_is_too_large_by_the_analytic_power(rows):
    # (a_c/a_l)^((3-D)/2), and below the limit F is linear in a_l: (F_c / 50 N)^0.35.
    law = paper.law(paper.Flank(2.3, paper.AVERAGED.G_m))
    assert rows["eq-10"].values["overestimate"] == pytest.approx(
        (law.all_plastic_force_n / 50.0) ** 0.35, rel=1e-9
    )


def test_a_pattern_chooses_and_a_wrong_one_is_refused():
    assert [r.name for r in compute(["eq-1[24]"])] == ["eq-12", "eq-14"]
    with pytest.raises(InputError, match="eq-99"):
        compute(["eq-99"])


def test_reports_hold_every_row_and_figure(tmp_path):
    rows = compute(["fig-1*", "eq-21"])
    for form, suffix in (("html", "html"), ("markdown", "md"), ("json", "json")):
        files = write(rows, tmp_path / form, form)
        text = next(f for f in files if f.suffix == f".{suffix}").read_text()
        assert all(r.source.split(",")[0] in text for r in rows)
        assert "T / (N d/2)" in text
    assert len(list((tmp_path / "markdown").glob("*.png"))) == 2
    assert "data:image/png;base64," in (tmp_path / "html" / "reproduction.html").read_text()
    with pytest.raises(InputError, match="form"):
        write(rows, tmp_path, "pdf")
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write(rows, blocked, "json")


def test_the_pages_escape_what_they_quote():
    rows = compute(["eq-10"])
    assert "a_l < a_c" not in to_html(rows, {})
    assert "a_l &lt; a_c" in to_html(rows, {})
    assert "&lt;" in to_markdown(rows, {})


def test_the_command(tmp_path):
    run = CliRunner()
    assert "eq-21" in run.invoke(reproduce, ["--list"]).output.split()
    result = run.invoke(reproduce, ["--only", "eq-21", "--json", "-o", str(tmp_path), "--format", "json"])
    assert result.exit_code == 0, result.output
    (row,) = json.loads(result.stdout)["rows"]
    assert row["verdict"] == "contradicted"
    assert json.loads((tmp_path / "reproduction.json").read_text())["rows"] == [row]
    assert "contradicted" in run.invoke(reproduce, ["--only", "eq-21"]).output


@pytest.mark.slow
def test_identification_finds_what_was_put_in():
    clean, noisy = compute(["round-trip-*"])
    for flank in ("CS", "pair", "FS"):
        assert clean.values[f"median_D_error_{flank}"] < 0.02
        assert 0.90 <= clean.values[f"coverage_{flank}"] <= 0.99
    assert noisy.values["good_or_warned"] == 1.0
