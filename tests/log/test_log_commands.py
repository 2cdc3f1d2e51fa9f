from __future__ import annotations

import csv

import numpy as np
import pytest
from click.testing import CliRunner
from comparing import assert_same_bits

from hdsim.errors import InputError
from hdsim.export.commands import export
from hdsim.log import commands, export_log, open_log, write_log


@pytest.fixture
def log(recording, tmp_path):
    return write_log(recording, tmp_path / "run.mcap")


def invoke(command, *arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments], env={"COLUMNS": "200"})


def test_info_lists_topics_columns_units_and_metadata(log):
    done = invoke(commands.info, log)
    assert done.exit_code == 0
    for text in ("/hd/state_view", "30000", "hdsim.State", "output torque", "N m", "joint — torque"):
        assert text in done.output
    for text in ("Radau, rtol 1e-6", "scenario.yaml", "3 x 4", "200"):
        assert text in done.output
    assert "joint — torque" not in invoke(commands.info, log, "--no-columns").output


def test_csv_brings_back_every_bit(log, recording, tmp_path):
    done = invoke(export, log, tmp_path / "out" / "state.csv")
    assert done.output.strip().endswith("state.csv")
    with open(tmp_path / "out" / "state.csv", newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["time [s]", "motor_angle [rad]", "output torque [N m]", "time [s]"]
    values = np.array(rows, np.float64)
    assert_same_bits(values[:, 0], recording.time)
    assert_same_bits(values[:, 1], recording["motor_angle"])
    assert_same_bits(values[:, 2], recording["output torque"])


def test_csv_of_arrays_has_a_column_each(log, recording, tmp_path):
    export_log(log, tmp_path / "a.csv", table="teeth")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0].startswith("time [s],normal_force[0] [N],normal_force[1] [N],")
    back = np.loadtxt(lines[1:], delimiter=",")
    assert_same_bits(back[:, 1:], recording.tables["teeth"]["normal_force"])
    export_log(log, tmp_path / "b.csv", table="empty")
    assert (tmp_path / "b.csv").read_text() == "time [s],a [m],b[0] [m],b[1] [m],b[2] [m],b[3] [m],b[4] [m]\n"


def test_parquet_keeps_bits_units_and_arrays(log, recording, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    back = parquet.read_table(export_log(log, tmp_path / "a.parquet", table="teeth"))
    field = back.schema.field("normal_force")
    assert field.metadata == {b"unit": b"N", b"description": b"per tooth"}
    values = back["normal_force"].combine_chunks().flatten().to_numpy(zero_copy_only=False)
    assert_same_bits(values.reshape(-1, 200), recording.tables["teeth"]["normal_force"])


def test_export_names_what_is_allowed(log, tmp_path):
    with pytest.raises(InputError, match=r"ending '\.xlsx'; allowed: \.csv, \.parquet"):
        export_log(log, tmp_path / "a.xlsx")
    with pytest.raises(InputError, match="no table 'tooth'; there are: state, teeth, empty"):
        export_log(log, tmp_path / "a.csv", table="tooth")
    assert list(tmp_path.iterdir()) == [log]


def test_verify_exits_with_1_on_a_damaged_log(log):
    done = invoke(commands.verify, log)
    assert done.exit_code == 0
    assert "sound: " in done.output
    data = bytearray(log.read_bytes())
    data[len(data) // 2] ^= 4
    log.write_bytes(data)
    done = invoke(commands.verify, log)
    assert done.exit_code == 1
    assert "problem: " in done.output


def test_recover_finds_a_name_for_the_new_log(log, tmp_path):
    whole = log.read_bytes()
    log.with_name("dead.mcap.partial").write_bytes(whole[: len(whole) // 2])
    done = invoke(commands.recover, tmp_path / "dead.mcap.partial")
    assert done.exit_code == 0
    assert "lost: " in done.output
    assert len(open_log(tmp_path / "dead.mcap").time)
    assert invoke(commands.recover, tmp_path / "dead.mcap.partial").exit_code == 0
    assert (tmp_path / "dead-recovered.mcap").exists()
    assert invoke(commands.recover, log).exit_code == 0
    assert (tmp_path / "run-recovered.mcap").exists()


def test_a_missing_log_is_an_input_error(tmp_path):
    for command in (commands.info, commands.verify, commands.recover):
        assert isinstance(invoke(command, tmp_path / "no.mcap").exception, InputError)
