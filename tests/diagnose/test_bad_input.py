"""What `hdsim diagnose` says of data, mappings, models and folders that it cannot work with."""

import json
import os
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from diagnose_bench import BASE, rigid_record, scenario
from mcap.writer import Writer

from hdsim.cli import main
from hdsim.diagnosis import workflow
from hdsim.errors import InputError
from hdsim.recording import Column, Recording, Table
from hdsim.tell.staging import staged

N = 1500
TORQUE = """ratio: -100
time: {column: t, unit: s}
channels:
  motor_angle: {column: motor, unit: rad}
  motor_torque: {column: torque, unit: N m}
"""
BOTH = TORQUE + "  output_angle: {column: output, unit: rad}\n"
TOPIC = """time: {stamp: log}
channels:
  motor_angle: {topic: /x, field: a, unit: rad}
  motor_torque: {topic: /x, field: b, unit: N m}
"""


@cache
def sound() -> dict[str, np.ndarray]:
    r = rigid_record(N / 500)
    motor = r.channels["motor_angle"]
    rng = np.random.default_rng(0)
    output = motor / -100 + 1e-6 * rng.standard_normal(N)
    return {"t": r.time, "motor": motor, "torque": r.channels["motor_torque"], "output": output}


@pytest.fixture
def ask(tmp_path, capsys):
    """Ask `hdsim diagnose`; returns its exit code and what it said on stderr, and sees OUT left clean."""
    scenario(tmp_path)
    scenario(tmp_path, "lumped")
    out = tmp_path / "out"

    def run(data, mapping=TORQUE, model="rigid.yaml", *more, to=out):
        if isinstance(data, dict):
            rows = zip(*(map(str, values) for values in data.values()), strict=True)
            text = "\n".join([",".join(data), *(",".join(row) for row in rows)])
            data = tmp_path / "data.csv"
            data.write_text(text + "\n", encoding="utf-8")
        elif isinstance(data, bytes | str):
            content = data.encode() if isinstance(data, str) else data
            data = tmp_path / (
                "data.csv" if mapping and "topic" not in mapping and "mcap" not in mapping else "data.mcap"
            )
            data.write_bytes(content)
        arguments = ["diagnose", str(data), "--model", str(tmp_path / model), "--out", str(to)]
        if mapping is not None:
            (tmp_path / "map.yaml").write_text(mapping, encoding="utf-8")
            arguments += ["--mapping", str(tmp_path / "map.yaml")]
        with pytest.raises(SystemExit) as stopped:
            main([*arguments, *map(str, more)])
        said = capsys.readouterr()
        if stopped.value.code == 2:
            assert not out.exists()
            assert "Traceback" not in said.err
            assert all(line.startswith("error: ") for line in said.err.splitlines())
            lines = [line for line in said.err.splitlines() if "(--force)" not in line]
            assert len(lines) == 1, lines
            assert len(lines[0]) < 500
        return stopped.value.code, said.err

    return run


def refused(answer, *words):
    code, said = answer
    assert code == 2
    for word in words:
        assert word in said


@pytest.mark.parametrize(
    ("mapping", "words"),
    [
        ("time: {column: t, unit: s\nchannels: [", ["map.yaml:2", "expected valid YAML"]),
        ("\x00\x01", ["map.yaml:1", "control character"]),
        ("", ["map.yaml:1", "empty file"]),
        ("- a\n", ["map.yaml:1", "found a list", "expected a mapping"]),
        (TORQUE.replace("motor_angle", "moter_angle"), ["map.yaml:4", "moter_angle", "'motor_angle'"]),
        (TORQUE.replace("unit: rad", "unit: degrees"), ["map.yaml:4", "'degrees'", "did you mean 'deg'"]),
        (TORQUE.replace("column: torque", "column: torqe"), ["data.csv", "'torqe'", "nearest: torque"]),
        (TORQUE.replace("column: t,", "column: zeit,"), ["data.csv", "'zeit'", "there are: t, motor"]),
        (TORQUE[: TORQUE.index("  motor_torque")], ["data.csv", "nothing can be predicted", "motor_torque"]),
        (
            TORQUE.replace("  motor_angle: {column: motor, unit: rad}\n", ""),
            ["data.csv", "motor_angle or output_angle", "found motor_torque"],
        ),
        (TORQUE.replace("-100", "-50"), ["data.csv", "ratio -50", "the model -100"]),
    ],
)
def test_a_mapping_that_does_not_fit_names_its_place(ask, mapping, words):
    refused(ask(sound(), mapping), *words)


@pytest.mark.parametrize("channel", ["motor", "output"])
@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (180 / np.pi, ["unit", "in degrees"]),
        (1 / (2 * np.pi), ["unit", "in revolutions"]),
        (10800 / np.pi, ["unit", "in arcmin"]),
        (-1.0, ["sign", "its sign reversed"]),
        (-100.0, ["side", "the other side of the gear:"]),
        (2.0, ["ratio", "another drive", "motor over output angle is -", "the model's ratio -100"]),
    ],
)
def test_two_angles_tell_a_wrong_unit_sign_side_or_ratio(ask, channel, factor, words):
    data = sound() | {channel: sound()[channel] * factor}
    answer = ask(data, BOTH, "lumped.yaml")
    refused(answer, "data.csv: output_angle", *(word.rstrip(":") for word in words))
    if factor == -100.0:
        assert "sign" not in answer[1]


def test_a_motor_faster_than_any_tells_degrees_for_radians(ask):
    data = sound() | {"motor": np.degrees(sound()["motor"])}
    refused(ask(data), "data.csv: motor_angle: unit", "rev/min", "wrong unit")


BACK = {"t": sound()["t"][::-1]}
TWICE = {"t": np.repeat(sound()["t"][::2], 2)}
NAN, STILL = np.full(N, np.nan), np.full(N, 0.1)
LATE = {"t": np.where(np.arange(N) < 700, sound()["t"], sound()["t"] + 1e9)}
PAUSES = {"t": sound()["t"] + 2.0 * (np.arange(N) // 150)}
NOISE = 1e-4 * np.random.default_rng(1).standard_normal(N)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (BACK, ["time does not increase", "sample 2 at 2.996 s"]),
        (TWICE, ["time does not increase", "750 such places", "quantised"]),
        ({"t": 0.0 * sound()["t"]}, ["time does not increase"]),
        ({"t": NAN}, ["sample 1 has no time"]),
        ({"t": sound()["t"] * 1e-3}, ["1500 samples over 0.003 s", "at least 200 samples over 0.5 s,"]),
        ({"t": sound()["t"] * 1e3}, ["time: clock", "one sample every 2 s", "ms for s"]),
        (PAUSES, ["motor_angle: gap", "missing for 2 s from 0.298 s", "allowed: at least 50 %"]),
        (LATE, ["longest gap, 1e+09 s, begins at 1.398 s", "cut the recording there"]),
        ({"torque": NAN}, ["motor_torque: missing: 1500 of 1500"]),
        ({"motor": NAN}, ["motor_angle: missing: 1500 of 1500"]),
        ({"torque": sound()["torque"] * 1e200}, ["motor_torque: missing", "beyond 1e+12"]),
        ({"motor": STILL}, ["nothing can be learned: nothing moves", "motor_angle does not vary"]),
        ({"motor": STILL, "torque": STILL}, ["nothing can be learned: nothing moves", "motor_angle"]),
        ({"motor": STILL + NOISE}, ["nothing can be learned: nothing moves", "motor_angle does not vary"]),
        ({"torque": STILL}, ["nothing can be learned: nothing answers", "motor_torque does not vary"]),
        ({"torque": ["abc"] * N}, ["data.csv:2", "column 'torque'", "found 'abc'", "expected a number"]),
        ({"torque": np.clip(sound()["torque"], -0.02, 0.02)}, ["motor_torque: saturated", "-0.02 and 0.02"]),
    ],
)  # fmt: skip
def test_data_that_cannot_answer_say_why(ask, changes, words):
    refused(ask(sound() | changes), "data.csv", *words)


def test_a_dead_channel_beside_a_saturated_one_leaves_nothing(ask):
    changes = {"torque": np.clip(sound()["torque"], -0.02, 0.02), "output": STILL}
    refused(ask(sound() | changes, BOTH, "lumped.yaml"), "motor_torque: saturated", "of 1500 samples")


@pytest.mark.parametrize("count", [2, 3, 100])
def test_a_short_record_is_told_how_long_it_must_be(ask, count):
    data = {name: values[:count] for name, values in sound().items()}
    refused(ask(data), f"data.csv: {count} samples over", "at least 200 samples over 0.5 s")


@pytest.mark.parametrize(
    ("data", "mapping", "words"),
    [
        ("Dear all,\nit squeaks.\n", TORQUE, ["data.csv", "no line holds numbers", "Dear all"]),
        (bytes(range(128, 256)) * 30, TORQUE, ["data.csv", "cannot be read as CSV"]),
        ("", TORQUE, ["data.csv: it is empty"]),
        ("t,motor,torque\n", TORQUE, ["data.csv: it is empty"]),
        ("t,motor,torque\n0,0,0\n", TORQUE, ["data.csv: one sample is no recording"]),
        ("t,motor,torque\n0,0\n", TORQUE, ["data.csv:2", "the line has 2 cells", "'torque' is number 3"]),
        ("", None, ["data.mcap is not an MCAP log", "empty file"]),
        (b"\x89PNG\r\n" * 100, None, ["data.mcap is not an MCAP log", "PNG"]),
        (b"\x89PNG\r\n" * 100, TOPIC, ["data.mcap: cannot be read as MCAP"]),
    ],
)
def test_a_file_that_is_no_recording_is_told(ask, data, mapping, words):
    refused(ask(data, mapping), *words)


def messages(path, bodies) -> bytes:
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channel = writer.register_channel("/x", "json", schema)
        for k, body in enumerate(bodies):
            writer.add_message(channel, log_time=2_000_000 * k, data=body, publish_time=0)
        writer.finish()
    return path.read_bytes()


def test_an_mcap_cut_off_or_damaged_is_told(ask, tmp_path):
    rows = zip(sound()["motor"], sound()["torque"], strict=True)
    bodies = [json.dumps({"a": a, "b": b}).encode() for a, b in rows]
    whole = messages(tmp_path / "whole.mcap", bodies)
    refused(ask(whole[: len(whole) // 2], TOPIC), "data.mcap", "cut off or damaged")
    bent = bytearray(whole)
    bent[2000 : len(bent) // 2 : 500] = b"\xff" * len(range(2000, len(bent) // 2, 500))
    refused(ask(bytes(bent), TOPIC), "data.mcap", "cut off or damaged")
    garbled = messages(tmp_path / "garbled.mcap", [*bodies[:500], b"{nope", *bodies[500:]])
    refused(ask(garbled, TOPIC), "data.mcap: /x: message 501 cannot be decoded")
    words = messages(tmp_path / "words.mcap", [b'{"a": "x", "b": 1}'])
    refused(ask(words, TOPIC), "data.mcap: /x: field 'a' is no number")
    refused(ask(whole, TOPIC.replace("field: b", "field: c")), "no field 'c'; there are: a, b")
    refused(ask(whole, TORQUE.replace("-100", "-100\nformat: mcap")), "has topics", "names column 'motor'")


def test_a_log_of_ours_cut_off_is_told_how_to_save_it(ask, tmp_path):
    columns = {
        "motor_angle": Column(sound()["motor"], "rad"),
        "motor_torque": Column(sound()["torque"], "N m"),
    }
    log = Recording({"state": Table(sound()["t"], columns)}).save(tmp_path / "whole.mcap").read_bytes()
    refused(ask(log[: len(log) // 2], None), "data.mcap is truncated", "hdsim recover")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, ["--model", "nothing.yaml", "does not exist"]),
        ("a: [1,", ["model.yaml:1", "expected valid YAML"]),
        (BASE.replace("MESH", "rigidd"), ["model.yaml:10", "drive.mesh.model", "'rigidd'", "'rigid'"]),
        (
            BASE.replace("MESH", "rigid").replace("torque_nm: 52", "torque_nm: -1"),
            ["model.yaml:4", "rated_torque_nm", "-1"],
        ),
    ],
)
def test_a_model_that_is_not_there_or_invalid_is_told(ask, tmp_path, text, words):
    if text is not None:
        (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    refused(ask(sound(), TORQUE, "model.yaml" if text is not None else "nothing.yaml"), *words)


def test_an_out_that_cannot_be_written_is_told_before_the_work(ask, tmp_path, monkeypatch):
    monkeypatch.setattr(workflow, "diagnose", None)
    refused(ask(sound(), to=tmp_path / "rigid.yaml" / "out"), "rigid.yaml/out", "cannot be written")
    refused(ask(sound(), to=tmp_path / "rigid.yaml"), "--out", "is a file")


def test_a_disk_that_fills_up_leaves_nothing_and_keeps_what_was_there(tmp_path):
    old, new = tmp_path / "old", tmp_path / "a" / "new"
    old.mkdir()
    (old / "verdict.json").write_text("old")

    def fill(out):
        with staged(out) as stage:
            (stage / "verdict.json").write_text("half")
            raise OSError(28, "No space left on device")

    for out in (old, new):
        with pytest.raises(InputError, match="No space left"):
            fill(out)
    assert [path.read_text() for path in old.iterdir()] == ["old"]
    assert not new.parent.exists()
    with staged(new) as stage:
        (stage / "verdict.json").write_text("whole")
    assert [path.name for path in new.iterdir()] == ["verdict.json"]


def test_a_record_cannot_be_held_out_and_seen(ask, tmp_path):
    refused(
        ask(sound(), TORQUE, "rigid.yaml", "--holdout", tmp_path / "data.csv"), "--holdout", "also a measured"
    )


@pytest.mark.slow
def test_the_real_command_exits_with_2(tmp_path):
    scenario(tmp_path)
    (tmp_path / "no.mcap").write_bytes(b"")
    for arguments in (["no.mcap", "--model", "rigid.yaml"], ["no.mcap", "--model", "no.mcap"]):
        done = subprocess.run(
            [sys.executable, "-m", "hdsim.cli", "diagnose", *arguments, "--out", "out"],
            cwd=tmp_path, capture_output=True, text=True, timeout=60, env={**os.environ}, check=False,
        )  # fmt: skip
        assert done.returncode == 2
        assert done.stderr.startswith("error: no.mcap")
        assert len(done.stderr.splitlines()) == 1
        assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_suspicion_leads_the_verdict_and_the_diagnosis_goes_on(ask, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "found.yaml").write_text("of an earlier diagnosis")
    short = {name: values[:400] for name, values in sound().items()}
    code, _ = ask(short | {"torque": 1000.0 * short["torque"]})
    assert code == 0
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text(encoding="utf-8"))
    assert verdict["sentence"].startswith("Check the data first: data.csv: motor_torque is 10")
    (problem,) = [p for p in verdict["data_problems"] if p["kind"] == "unit"]
    assert problem["severity"] == "warning"
    assert not [path for path in (tmp_path / "out").iterdir() if path.name.startswith(".")]
    assert (tmp_path / "out" / "found.yaml").exists() == (verdict["scenario"] is not None)
