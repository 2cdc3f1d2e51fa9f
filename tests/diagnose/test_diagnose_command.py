from pathlib import Path

import numpy as np
from click.testing import CliRunner
from diagnose_bench import rigid_record, scenario

import hdsim
from hdsim.diagnosis.verdict import Verdict
from hdsim.recording import Column, Recording, Table
from hdsim.tell.commands import diagnose


def log(path: Path, **channels: np.ndarray) -> Path:
    record = rigid_record(6.0, coulomb=0.045, seed=7)
    values = {**record.channels, **channels}
    columns = {name: Column(v, "rad" if "angle" in name else "N m") for name, v in values.items()}
    return Recording({"state": Table(record.time, columns)}).save(path)


def test_a_log_gives_verdict_scenario_report_and_log(tmp_path):
    scenario(tmp_path)
    out = tmp_path / "out"
    arguments = [str(log(tmp_path / "run.mcap")), "--model", str(tmp_path / "rigid.yaml"), "--out", str(out)]
    result = CliRunner().invoke(diagnose, arguments, standalone_mode=False)
    assert result.exception is None
    verdict = Verdict.model_validate_json((out / "verdict.json").read_text(encoding="utf-8"))
    assert verdict.verdict == "parameter"
    assert "drive.friction.coulomb_nm" in verdict.moved
    assert result.output.startswith("parameter")
    changed = hdsim.load_scenario(out / "found.yaml").drive.friction.coulomb_nm
    assert abs(changed - 0.045) < 0.002
    assert "Parameters of the model are wrong" in (out / "report.html").read_text(encoding="utf-8")
    compared = hdsim.open_log(out / "compared.mcap")
    assert {"measured", "before", "refit", "after"} <= set(compared.tables)


def test_a_log_in_which_nothing_moves_is_refused_with_the_reason(tmp_path):
    scenario(tmp_path)
    still = log(tmp_path / "still.mcap", motor_torque=np.full(3000, 0.1))
    arguments = [str(still), "--model", str(tmp_path / "rigid.yaml"), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(diagnose, arguments, standalone_mode=False)
    assert isinstance(result.exception, hdsim.InputError)
    assert "nothing can be learned" in str(result.exception)
    assert "motor_torque does not vary" in str(result.exception)
