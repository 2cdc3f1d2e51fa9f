import json

import pytest
from rig import model, record

from hdsim.cli import main
from hdsim.estimate import all_data
from hdsim.estimate.predict import PredictionError
from hdsim.recording import Column, Recording, Table
from hdsim.tell.words import FROM_ALL_DATA, NOT_FROM_ALL_DATA


@pytest.fixture
def ask(tmp_path, capsys):
    """Run ``hdsim fit``; returns its exit code, stdout and stderr."""
    model(tmp_path)
    one = record(0, 3.0)
    columns = {c: Column(v, "rad" if "angle" in c else "N m") for c, v in one.channels.items()}
    Recording({"state": Table(one.time, columns)}).save(tmp_path / "run.mcap")

    def run(*more, data="run.mcap", scenario="rig.yaml"):
        with pytest.raises(SystemExit) as stop:
            main(["fit", str(tmp_path / data), "--model", str(tmp_path / scenario), *more])
        said = capsys.readouterr()
        return stop.value.code, said.out, said.err

    return run


def test_a_log_gives_numbers_page_and_scenario(ask, tmp_path):
    code, out, err = ask("--out", str(tmp_path / "out"), "--fix", "motor_torque_gain")
    assert code == 0, err
    assert "parameters are identifiable from these data" in out
    for word in ("load mass", "95 % interval", "after/noise", "fit.html", "fitted.yaml"):
        assert word in out
    assert (tmp_path / "out" / "fit.html").exists()


def lost(bench, found):
    raise PredictionError


@pytest.mark.parametrize("followed", [True, False])
def test_numbers_say_whether_they_are_of_all_data(ask, tmp_path, monkeypatch, followed):
    if not followed:
        monkeypatch.setattr(all_data, "together", lost)
    code, out, err = ask("--out", str(tmp_path / "out"), "--fix", "motor_torque_gain", "--all-data")
    assert code == 0, err
    said = FROM_ALL_DATA if followed else NOT_FROM_ALL_DATA
    assert " ".join(said.split()) in " ".join(out.split())
    result = json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))
    assert result["estimated_from"] == ("all" if followed else "training")


@pytest.mark.parametrize(
    ("more", "where", "message"),
    [
        (["--free", "drive.frction.coulomb_nm"], {}, "drive.frction.coulomb_nm: no parameter of this model"),
        (["--apart", "load.inertia"], {}, "load.inertia: no parameter of this model"),
        (["--load", "load_torque"], {}, "the load is to come from load_torque, which is not measured"),
        ([], {"data": "none.mcap"}, "none.mcap"),
        ([], {"scenario": "bad.yaml"}, "bad.yaml"),
        ([], {"data": "rig.yaml"}, "rig.yaml"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(ask, tmp_path, more, where, message):
    (tmp_path / "bad.yaml").write_text("drive: {preset: 7}\n", encoding="utf-8")
    code, _, err = ask("--out", str(tmp_path / "out"), *more, **where)
    assert code == 2
    assert message in err
    assert "Traceback" not in err
    assert all(line.startswith("error: ") for line in err.strip().split("\n"))
    assert not (tmp_path / "out").exists()


def test_a_record_cannot_prove_what_it_taught(ask, tmp_path):
    code, _, err = ask("--out", str(tmp_path / "out"), "--holdout", str(tmp_path / "run.mcap"))
    assert code == 2
    assert err.count("\n") == 1
    assert "is also a measured record" in err
