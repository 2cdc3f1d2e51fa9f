"""The table that holds hdsim against the world: its rows, its judgement, the page that shows it."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from hdsim.cli import main
from hdsim.validate.__main__ import BEGIN, END
from hdsim.validate.report import deviation, number, summary, to_json, to_markdown
from hdsim.validate.rows import Row, Verdict
from hdsim.validate.table import compute, names

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"


def made(stated: float, computed: float, tolerance: float, **other: object) -> Row:
    return Row("x", "quantity", "N m", "source", stated, computed, tolerance, "because", **other)  # type: ignore[arg-type]


def test_a_row_is_judged_by_its_tolerance() -> None:
    assert made(100, 104, 0.05).verdict == Verdict.HOLDS
    assert made(100, 94, 0.05).verdict == Verdict.FAILS
    assert made(0.93, 0.89, 0.03, relative=False).verdict == Verdict.FAILS
    assert made(60, 59, 0, limit=True).verdict == Verdict.HOLDS
    assert made(60, 61, 0, limit=True).verdict == Verdict.FAILS
    assert made(60, math.nan, 0.1).verdict == Verdict.ABSENT
    assert deviation(made(100, 104, 0.05)) == "+4.0 %"
    assert number(16416.2) == "16,416"
    assert number(math.nan) == "-"


def test_the_summary_counts_apart_what_set_a_number() -> None:
    rows = [made(1, 1, 0.1), made(1, 1, 0.1, fitted=True), made(1, 2, 0.1), made(1, math.nan, 0.1)]
    assert summary(rows) == (
        "2 of 4 rows hold, 1 fail, the data of 1 are absent; of those that calibrate no parameter 1 hold "
        "and 1 fail"
    )


def test_rows_without_their_data_are_absent_and_never_fail() -> None:
    rows = compute(["kinova-*", "lara8-*", "cycloidal-*"])
    assert len(rows) == 10
    assert {row.verdict for row in rows} == {Verdict.ABSENT}
    assert "data absent" in to_markdown(rows)
    assert json.loads(to_json(rows))["rows"][0]["computed"] is None


def test_names_are_unique_and_rows_come_in_their_order() -> None:
    assert len(set(names())) == len(names()) > 30
    rows = compute(["wind-up-*", "average-torque", "ratcheting-*", "buckling-*", "erob80-*"])
    wanted = [name for name in names() if name in {row.name for row in rows}]
    assert [row.name for row in rows] == wanted


def test_the_limit_cycle_is_that_of_three_other_ways() -> None:
    rows = {row.name: row for row in compute(["limit-cycle-*"])}
    assert rows["limit-cycle-scipy-amplitude"].deviation == pytest.approx(0.0, abs=1e-5)
    assert rows["limit-cycle-scipy-frequency"].deviation == pytest.approx(0.0, abs=1e-5)
    # The harmonic balance shares no line with the other two; it is off by what harmonics do.
    assert 0.01 < abs(rows["limit-cycle-balance-frequency"].deviation) < 0.1


def test_pitch_errors_of_the_teeth_make_the_order_of_kinematics() -> None:
    found = {row.name: row for row in compute(["orders-*"])}
    assert found["orders-100"].computed == pytest.approx(2 * 202 / 200)
    assert found["orders-50"].computed == pytest.approx(4 * 102 / 100)
    assert found["orders-50"].verdict == Verdict.FAILS  # the print's 4.04 fits no line of ratio 50


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    def run(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as exit_:
            main(["validate", *arguments])
        out, err = capsys.readouterr()
        return int(exit_.value.code or 0), out, err

    code, out, _ = run("--only", "average-torque")
    assert code == 0
    assert "89.39" in out
    assert "Honpine" in out
    assert run("--only", "ratcheting-14")[0] == 1
    assert run("--list")[1].split() == names()
    code, _, err = run("--only", "nonsense")
    assert code == 2
    assert "nonsense" in err
    code, _, err = run("--data", str(tmp_path / "nothing"))
    assert code == 2
    assert "found no folder" in err
    assert json.loads(run("--only", "average-torque", "--json")[1])["rows"][0]["verdict"] == "holds"


@pytest.mark.slow
@pytest.mark.skipif(not DATA.exists(), reason="the recordings are not here")
def test_the_table_in_the_readme_is_what_the_command_computes() -> None:
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = page.split(BEGIN)[1].split(END)[0].strip()
    computed = to_markdown(compute(data=DATA)).strip()
    again = "run: python -m hdsim.validate README.md --data ../shared/data"

    def words(text: str) -> list[str]:
        return re.sub(r"[-+]?[\d,]*\.?\d+(e[-+]?\d+)?", "#", text).splitlines()

    assert words(shown) == words(computed), again
    for ours, theirs in zip(computed.splitlines()[2:], shown.splitlines()[2:], strict=True):
        cells, others = ours.split(" | "), theirs.split(" | ")
        if len(cells) < 8:
            continue
        for mine, other in zip(cells[2:4], others[2:4], strict=True):
            # Other processors and versions of MuJoCo and SciPy round the last digits.
            value = float(mine.replace(",", ""))
            assert float(other.replace(",", "")) == pytest.approx(value, rel=0.02), f"{cells[0]}; {again}"


def test_at_least_twelve_rows_set_no_number_of_the_model_and_hold() -> None:
    rows = compute(
        ["limit-cycle-*", "stick-slip", "resonance", "wind-up-*", "average-torque", "orders-*", "lost-*"]
    )
    assert sum(row.verdict == Verdict.HOLDS and not row.fitted for row in rows) >= 12
