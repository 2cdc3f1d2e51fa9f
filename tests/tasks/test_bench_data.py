"""A recording as it lies on a bench becomes a log, from an empty folder with the command line alone."""

from __future__ import annotations

import csv
import datetime
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import hdsim
from hdsim.cli import main
from hdsim.recording import Recording

N = 600
TIME = np.arange(N) * 2e-3
OUTPUT_ANGLE = 0.8 * np.sin(2 * np.pi * 1.5 * TIME) + 0.1 * TIME
OUTPUT_VELOCITY = 0.8 * 2 * np.pi * 1.5 * np.cos(2 * np.pi * 1.5 * TIME) + 0.1
OUTPUT_TORQUE = 15 * np.cos(2 * np.pi * 1.5 * TIME) + 2
MOTOR_ANGLE = 100 * OUTPUT_ANGLE + OUTPUT_TORQUE * 0.004
MOTOR_TORQUE = OUTPUT_TORQUE / 80
TRUTH = {
    "motor_angle": MOTOR_ANGLE,
    "output_angle": OUTPUT_ANGLE,
    "output_velocity": OUTPUT_VELOCITY,
    "motor_torque": MOTOR_TORQUE,
    "output_torque": OUTPUT_TORQUE,
}
#: The truth in the units of a bench: s, rev, deg, rpm, mN m, N m.
BENCH = np.column_stack(
    [
        TIME,
        MOTOR_ANGLE / (2 * np.pi),
        np.rad2deg(OUTPUT_ANGLE),
        OUTPUT_VELOCITY * 60 / (2 * np.pi),
        1e3 * MOTOR_TORQUE,
        OUTPUT_TORQUE,
    ]
)
NAMES = ["time", "motor_angle", "output_angle", "output_velocity", "motor_torque", "output_torque"]
UNITS = ["s", "rev", "deg", "rpm", "mNm", "Nm"]
HEAD = [f"{name} [{unit}]" for name, unit in zip(NAMES, UNITS, strict=True)]
GERMAN = ["Zeit [s]", "Motorwinkel [U]", "Abtriebswinkel [°]", "Abtriebsdrehzahl [U/min]",
          "Motormoment [mNm]", "Abtriebsdrehmoment [Nm]"]  # fmt: skip
#: Half of the last digit that text keeps, in SI, of the coarsest column.
PRINTED = 1e-6


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def command(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return int(ended.value.code or 0)


def imported(file: str, *options: str) -> Recording:
    """What the two commands make of a file."""
    assert command("mapping", file, *options) == 0
    assert command("check", "mapping.yaml", "base.yaml") == 0
    assert command("import", file, "--mapping", "mapping.yaml", "-o", "log.mcap") == 0
    return hdsim.open_log("log.mcap")


def agrees(found: Recording, without: tuple[str, ...] = (), tolerance: float = PRINTED) -> None:
    np.testing.assert_allclose(found.time, TIME, atol=1e-6)
    assert {name for name in found if name != "transmission_error"} == set(TRUTH) - set(without)
    for name, truth in TRUTH.items():
        if name not in without:
            np.testing.assert_allclose(found[name], truth, atol=tolerance * max(1.0, np.abs(truth).max()))
    assert float(found.metadata["ratio"]) == 100


def cells(decimal: str = ".", digits: int = 8) -> list[list[str]]:
    return [[f"{x:.{digits}f}".replace(".", decimal) for x in row] for row in BENCH]


def text(head: list[str], rows: list[list[str]], separator: str) -> str:
    return "\n".join(separator.join(row) for row in [head, *rows]) + "\n"


def plain() -> str:
    Path("a.csv").write_text(text(HEAD, cells(), ","))
    return "a.csv"


def german() -> str:
    Path("a.csv").write_bytes(text(GERMAN, cells(","), ";").replace("\n", "\r\n").encode("cp1252"))
    return "a.csv"


def utf_16_tabs() -> str:
    Path("a.tsv").write_bytes(text(GERMAN, cells(","), "\t").encode("utf-16"))
    return "a.tsv"


def iso_times_after_a_byte_order_mark() -> str:
    start = datetime.datetime(2024, 7, 11, 23, 59, 59, tzinfo=datetime.UTC)
    rows = cells()
    for k, row in enumerate(rows):
        row[0] = (start + datetime.timedelta(milliseconds=2 * k)).isoformat(timespec="milliseconds")
    Path("a.csv").write_text(text(HEAD, rows, ","), encoding="utf-8-sig")
    return "a.csv"


def times_of_day_over_midnight() -> str:
    rows = cells(",")
    for k, row in enumerate(rows):
        ms = (86_399_500 + 2 * k) % 86_400_000
        row[0] = f"{ms // 3_600_000:02d}:{ms // 60_000 % 60:02d}:{ms // 1000 % 60:02d},{ms % 1000:03d}"
    Path("a.txt").write_text(text(["Uhrzeit", *GERMAN[1:]], rows, ";"))
    return "a.txt"


def names_in_a_comment_and_spaces() -> str:
    names = "time_s motor_angle_rev output_angle_deg output_velocity_rpm motor_torque_mNm output_torque_Nm"
    np.savetxt("a.dat", BENCH, fmt="%14.8f", header=f"bench 3, 2 kHz filter\n{names}")
    return "a.dat"


def a_row_of_units() -> str:
    Path("a.csv").write_text(text(NAMES, [UNITS, *cells()], ","))
    return "a.csv"


def groups_of_thousands_in_quotes() -> str:
    with open("a.csv", "w", newline="") as file:
        writer = csv.writer(file, quoting=csv.QUOTE_ALL)
        writer.writerow(["time [ms]", *HEAD[1:]])
        writer.writerows([f"{x:,.7f}" for x in row] for row in BENCH * [1e3, 1, 1, 1, 1, 1])
    return "a.csv"


def german_groups() -> str:
    rows = [
        [f"{x:,.7f}".translate(str.maketrans(",.", ".,")) for x in row]
        for row in BENCH * [1e3, 1, 1, 1, 1, 1]
    ]
    Path("a.csv").write_text(text([GERMAN[0].replace("[s]", "[ms]"), *GERMAN[1:]], rows, ";"))
    return "a.csv"


def lines_before_the_names() -> str:
    before = "Test bench 7\nOperator;A. Mustermann\nSample rate;500\nDate;2024-07-11\n\n"
    Path("a.csv").write_text(before + text(HEAD, cells(), ";"))
    return "a.csv"


def flags_and_words_beside() -> str:
    rows = [[*row, "OK" if k % 7 else "WARN", "true"] for k, row in enumerate(cells())]
    Path("a.csv").write_text(text([*HEAD, "state", "enabled"], rows, "|"))
    return "a.csv"


def counts_and_a_counter_that_starts_anew() -> str:
    counts = np.round(MOTOR_ANGLE / (2 * np.pi) * 2**20).astype(int)
    rows = cells()
    for k, row in enumerate(rows):
        row[0], row[1] = str((65_000 + 2 * k) % 65_536), str(counts[k])
    Path("a.csv").write_text(text(["t [ms]", "encoder motor [counts]", *HEAD[2:]], rows, ","))
    return "a.csv"


HABITS: list[Callable[[], str]] = [
    plain, german, utf_16_tabs, iso_times_after_a_byte_order_mark, times_of_day_over_midnight,
    names_in_a_comment_and_spaces, a_row_of_units, groups_of_thousands_in_quotes, german_groups,
    lines_before_the_names, flags_and_words_beside,
]  # fmt: skip


@pytest.mark.parametrize("habit", HABITS, ids=lambda habit: habit.__name__)
def test_text_of_any_habit(habit: Callable[[], str]) -> None:
    agrees(imported(habit()))


def test_counts_whose_turn_the_other_angle_tells() -> None:
    found = imported(counts_and_a_counter_that_starts_anew(), "--set", "ratio=100")
    agrees(found, tolerance=2 * np.pi / 2**20)
    assert "counts_per_turn: 1048576" in Path("mapping.yaml").read_text()


def test_numbers_without_names() -> None:
    Path("a.csv").write_text("\n".join(" ".join(row) for row in cells()) + "\n")
    assert command("mapping", "a.csv") == 1  # nothing says what is what
    Path("mapping.yaml").unlink()
    said = []
    for k, (name, unit) in enumerate(zip(NAMES, ["s", "rev", "deg", "rpm", "mN m", "N m"], strict=True)):
        if k:
            said += ["--set", f"column {k + 1}.channel={name}", "--set", f"column {k + 1}.unit={unit}"]
    agrees(imported("a.csv", *said))


def test_missing_numbers_stay_missing() -> None:
    rows = cells()
    for k, word in enumerate(["", "-", "NaN", "n/a", "#NV"]):
        rows[10 + 20 * k][5] = word
    Path("a.csv").write_text(text(HEAD, rows, ";"))
    found = imported("a.csv")
    gone = np.flatnonzero(np.isnan(found["output_torque"]))
    np.testing.assert_array_equal(gone, [10, 30, 50, 70, 90])
    np.testing.assert_allclose(found["output_angle"], OUTPUT_ANGLE, atol=PRINTED)


def excel() -> str:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Made on bench 3"])
    book.active.append(NAMES)
    book.active.append(UNITS)
    for row in BENCH.tolist():
        book.active.append(row)
    book.create_sheet("notes").append(["nothing to see here"])
    book.save("a.xlsx")
    return "a.xlsx"


def columns() -> dict[str, np.ndarray]:
    return {f"{n}_{u}": BENCH[:, k] for k, (n, u) in enumerate(zip(NAMES, UNITS, strict=True))}


def matlab() -> str:
    from scipy.io import savemat

    savemat("a.mat", {"bench": columns(), "comment": "of today"}, oned_as="column")
    return "a.mat"


def hdf5() -> str:
    h5py = pytest.importorskip("h5py")
    with h5py.File("a.h5", "w") as file:
        for name, unit, values in zip(NAMES, UNITS, BENCH.T, strict=True):
            file.create_dataset(f"run1/{name}", data=values).attrs["units"] = unit
    return "a.h5"


def matlab_7_3() -> str:
    h5py = pytest.importorskip("h5py")
    # As MATLAB does: a user block with its header, vectors as matrices of one row.
    with h5py.File("a.mat", "w", userblock_size=512) as file:
        for name, values in columns().items():
            file.create_dataset(f"bench/{name}", data=values[np.newaxis, :]).attrs["MATLAB_class"] = b"double"
    with open("a.mat", "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return "a.mat"


def tdms() -> str:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter("a.tdms") as writer:
        rate = {"wf_increment": 2e-3, "wf_start_offset": 0.0}
        writer.write_segment(
            [
                nptdms.ChannelObject("bench", name, values, {"unit_string": unit, **rate})
                for name, unit, values in zip(NAMES[1:], UNITS[1:], BENCH.T[1:], strict=True)
            ]
        )
    return "a.tdms"


def mdf() -> str:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(samples=values, timestamps=TIME + 5.0, name=name, unit=unit)
                for name, unit, values in zip(NAMES[1:], UNITS[1:], BENCH.T[1:], strict=True)
            ]
        )
        file.save("a.mf4")
    return "a.mf4"


def parquet() -> str:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as pq

    pq.write_table(pa.table(columns()), "a.parquet", row_group_size=100)
    return "a.parquet"


@pytest.mark.parametrize(
    "written", [excel, matlab, matlab_7_3, hdf5, tdms, mdf, parquet], ids=lambda written: written.__name__
)
def test_binary_files_of_other_writers(written: Callable[[], str]) -> None:
    agrees(imported(written()), tolerance=1e-12)


@pytest.mark.parametrize("version", [1, 2])
def test_ros_bags(version: int) -> None:
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
    kinds, kind = store.types, "sensor_msgs/msg/JointState"
    if version == 1:
        from rosbags.rosbag1 import Writer

        bag, options = "a.bag", {}
    else:
        from rosbags.rosbag2 import Writer  # type: ignore[assignment]

        bag, options = "bag", {"version": 9}
    more = {"seq": 0} if version == 1 else {}
    with Writer(bag, **options) as writer:
        link = writer.add_connection("/bench", kind, typestore=store)
        for k in range(N):
            at = 1_700_000_000_000_000_000 + 2_000_000 * k
            stamp = kinds["builtin_interfaces/msg/Time"](sec=at // 10**9, nanosec=at % 10**9)
            message = kinds[kind](
                header=kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="", **more),
                name=["motor", "output"],
                position=np.array([MOTOR_ANGLE[k], OUTPUT_ANGLE[k]]),
                velocity=np.array([0.0, OUTPUT_VELOCITY[k]]),
                effort=np.array([MOTOR_TORQUE[k], OUTPUT_TORQUE[k]]),
            )
            body = store.serialize_ros1(message, kind) if version == 1 else store.serialize_cdr(message, kind)
            writer.write(link, at, bytes(body))
    agrees(imported(bag), tolerance=1e-12)


def test_a_reader_that_is_absent_is_named_with_its_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import sys

    for file, package, module, extra in (
        ("a.xlsx", "openpyxl", "openpyxl", "excel"),
        ("a.h5", "h5py", "h5py", "hdf5"),
        ("a.tdms", "npTDMS", "nptdms", "tdms"),
        ("a.mf4", "asammdf", "asammdf", "mdf"),
        ("a.bag", "rosbags", "rosbags.highlevel", "ros"),
    ):
        monkeypatch.setitem(sys.modules, module, None)
        Path(file).write_bytes(b"\x00" * 64)
        assert command("mapping", file) == 2
        assert f"needs the package {package}: pip install 'hdsim[{extra}]'" in capsys.readouterr().err
    assert not Path("mapping.yaml").exists()


def test_what_is_open_is_asked_on_a_terminal_and_listed_elsewhere(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("a.csv").write_text(text(["time_s", "position_deg"], [row[:3:2] for row in cells()], ","))
    assert command("mapping", "a.csv") == 1
    assert "--set 'position_deg.channel=output_angle'" in capsys.readouterr().err
    assert command("check", "mapping.yaml") == 2  # nothing is mapped yet
    assert "no channel is mapped" in capsys.readouterr().err
    assert command("mapping", "a.csv") == 2
    assert "there is a file already" in capsys.readouterr().err
    for stream in ("stdin", "stderr"):
        monkeypatch.setattr(f"sys.{stream}.isatty", lambda: True)
    answers, asked = ["up", "output_angle"], []
    monkeypatch.setattr("click.prompt", lambda words, **options: asked.append(words) or answers.pop(0))
    assert command("mapping", "a.csv", "--force") == 0
    asks = "The channel of position_deg: output_angle or motor_angle"
    asks += " (for example output_angle; - leaves it open)"
    assert asked == 2 * [asks]
    assert "found 'up', expected motor_angle" in capsys.readouterr().err
    assert command("check", "mapping.yaml") == 0


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--set", "nonsense"], "expected KEY=VALUE"),
        (["--set", "ratio=x"], "expected a number"),
        (["--set", "ratio=0.01"], "at least 1"),
        (["--set", "time.unit=min"], "expected s, ms, us, ns"),
        (["--set", "time.column=clock"], "no column 'clock'"),
        (["--set", "output_angle [deg].unit=rpm"], "expected rad, mrad, deg"),
        (["--set", "motor_torque [mNm].unit=kNm"], "expected N m, mN m, N cm, kN m, lbf in, lbf ft, A, mA"),
        (["--set", "output_angle [deg].side=left"], "expected motor or output"),
        (["--axis", "3"], "a.csv holds one axis"),
        (["--set", "speed.unit=rpm"], "no column 'speed'"),
        (["--set", "time.colour=blue"], "expected ratio, time.KEY"),
        (["--set", "output_angle [deg].channel=angle"], "expected motor_angle"),
        (["-o", "nowhere/m.yaml"], "no such folder"),
    ],
)
def test_what_is_said_wrongly_is_refused_and_nothing_written(
    options: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("mapping", plain(), *options) == 2
    assert complaint in capsys.readouterr().err
    assert [path.name for path in Path().iterdir()] == ["a.csv"]
