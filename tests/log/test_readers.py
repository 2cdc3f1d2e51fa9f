"""Readers of foreign files: what is in a cell, where the numbers of a table begin, damaged files."""

from __future__ import annotations

import datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.errors import InputError
from hdsim.log.importing import import_recording
from hdsim.log.mapping import Form
from hdsim.log.readers import FORMATS, delimited, format_of
from hdsim.log.readers.cells import date, decimal_mark, number


@pytest.mark.parametrize(
    ("text", "decimal", "value"),
    [
        ("1.5", ".", 1.5),
        ("-1,5e-3", ",", -1.5e-3),
        ("1.234,5", ",", 1234.5),
        ("1,234,567.25", ".", 1234567.25),
        ("1'234.5", ".", 1234.5),
        ("1\u202f234,5", ",", 1234.5),
        ("\u22121.5", ".", -1.5),
        (".5", ".", 0.5),
        ("1D3", ".", 1000.0),
        ("TRUE", ".", 1.0),
    ],
)
def test_numbers_as_people_write_them(text: str, decimal: str, value: float) -> None:
    assert number(text, decimal) == value


@pytest.mark.parametrize("text", ["", " - ", "NaN", "n/a", "#NV", "null"])
def test_cells_that_say_there_is_no_number(text: str) -> None:
    assert np.isnan(number(text, "."))


@pytest.mark.parametrize(
    ("text", "decimal"), [("1,5", "."), ("1.5", ","), ("12,34.5", "."), ("1_0", "."), ("x", ".")]
)
def test_what_is_no_number(text: str, decimal: str) -> None:
    with pytest.raises(ValueError, match=text):
        number(text, decimal)


@pytest.mark.parametrize(
    ("cells", "mark"),
    [
        (["1,5", "2"], ","),
        (["1,234", "0.5"], "."),
        (["1,234", "0,500"], ","),
        (["1,234", "12"], None),
        (["1,234,567"], "."),
        (["1.234,5"], ","),
        (["1.5"], "."),
    ],
)
def test_the_decimal_mark_is_known_or_asked_for(cells: list[str], mark: str | None) -> None:
    assert decimal_mark(cells) == mark


@given(st.datetimes(datetime.datetime(1900, 1, 1), datetime.datetime(2200, 1, 1)), st.sampled_from("T "))
def test_dates_are_exact(moment: datetime.datetime, between: str) -> None:
    text = moment.isoformat(between, timespec="microseconds")
    assert date(text) == np.datetime64(moment, "ns")
    assert date(text + "Z") == date(text + "+00:00") == date(text)
    assert date(text + "123") - date(text) == np.timedelta64(123, "ns")


@settings(max_examples=60, deadline=None)
@given(
    numbers=st.lists(
        st.tuples(*3 * [st.floats(-1e6, 1e6).map(lambda x: round(x, 4))]), min_size=3, max_size=30
    ),
    form=st.sampled_from(
        [(",", "."), (";", "."), (";", ","), ("\t", ","), ("\t", "."), ("|", ","), (" ", ".")]
    ),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"]),
    head=st.sampled_from([["Zeit", "Höhe", "x"], ["# a", "b", "c"], None]),
    quoted=st.booleans(),
)
def test_every_form_of_a_table_reads_back(tmp_path_factory, numbers, form, encoding, head, quoted):
    separator, decimal = form
    path = tmp_path_factory.mktemp("t") / "a.csv"
    rows = [[f"{x:.4f}".replace(".", decimal) for x in row] for row in numbers]
    if quoted and separator != " ":
        rows = [[f'"{cell}"' for cell in row] for row in rows]
    lines = [separator.join(row) for row in ([head, *rows] if head else rows)]
    path.write_text("\n".join(lines), encoding=encoding)
    table = delimited.open_table(path)
    found = np.column_stack(table.read([0, 1, 2]))
    np.testing.assert_array_equal(found, np.array(numbers))
    assert [name.lstrip("# ") for name in table.names] == (
        [name.lstrip("# ") for name in head] if head else 3 * [""]
    )


def test_a_table_is_read_in_chunks_and_an_error_has_its_line(tmp_path, monkeypatch):
    monkeypatch.setattr(delimited, "CHUNK", 7)
    lines = ["t,a", *(f"{k},{k * k}" for k in range(50))]
    lines[20:20] = ["# a remark", ""]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    table = delimited.open_table(tmp_path / "a.csv")
    heard: list[float] = []
    np.testing.assert_array_equal(table.read([1], None, heard.append)[0], np.arange(50) ** 2)
    assert len(heard) == 8
    assert heard[-1] == 1.0
    np.testing.assert_array_equal(table.read([0], 10)[0], np.arange(10))
    lines[45] = "43,x"
    (tmp_path / "a.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"a\.csv:46: column 'a': found 'x', expected a number"):
        table.read([1])


def test_what_a_comma_means_is_said_where_it_cannot_be_known(tmp_path):
    (tmp_path / "a.csv").write_text("t;a\n" + "".join(f"{k};{k + 1},000\n" for k in range(9)))
    with pytest.raises(InputError, match="may be a decimal comma or a group of thousands"):
        delimited.open_table(tmp_path / "a.csv")
    for decimal, factor in ((",", 1), (".", 1000)):
        table = delimited.open_table(tmp_path / "a.csv", Form(decimal=decimal))
        np.testing.assert_array_equal(table.read([1])[0], factor * np.arange(1, 10))


def test_columns_by_number_and_names_that_stand_twice(tmp_path):
    (tmp_path / "a.csv").write_text("t,a,a\n" + "".join(f"{k},{k},{2 * k}\n" for k in range(9)))
    mapping = tmp_path / "m.yaml"
    for column, factor in (("2", 1), ("3", 2)):
        mapping.write_text(
            f"time: {{column: t, unit: s}}\nchannels: {{output_angle: {{column: {column}, unit: rad}}}}\n"
        )
        found = import_recording(tmp_path / "a.csv", mapping)
        np.testing.assert_array_equal(found["output_angle"], factor * np.arange(9))
    for column, text in (("a", r"2 columns are called 'a'.*\(2, 3\)"), ("4", "no column 4; it has 3")):
        mapping.write_text(
            f"time: {{column: t, unit: s}}\nchannels: {{output_angle: {{column: {column}, unit: rad}}}}\n"
        )
        with pytest.raises(InputError, match=text):
            import_recording(tmp_path / "a.csv", mapping)


def test_dates_need_the_unit_that_says_so(tmp_path):
    (tmp_path / "a.csv").write_text("t,a\n2024-01-01T00:00:00,1\n2024-01-01T00:00:01.5,2\n")
    mapping = tmp_path / "m.yaml"
    text = "time: {column: t, unit: iso}\nchannels: {output_angle: {column: a, unit: rad}}\n"
    mapping.write_text(text)
    np.testing.assert_array_equal(import_recording(tmp_path / "a.csv", mapping).time, [0, 1.5])
    mapping.write_text(text.replace("iso", "s"))
    with pytest.raises(InputError, match="unit is s, but its column holds dates"):
        import_recording(tmp_path / "a.csv", mapping)
    mapping.write_text(text.replace("column: t", "column: a"))
    with pytest.raises(InputError, match="unit is iso, but its column holds numbers"):
        import_recording(tmp_path / "a.csv", mapping)
    mapping.write_text("time: {rate_hz: 1}\nchannels: {output_angle: {column: t, unit: rad}}\n")
    with pytest.raises(InputError, match="output_angle: column 't' holds dates"):
        import_recording(tmp_path / "a.csv", mapping)


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in ("csv", "ros2")])
@pytest.mark.parametrize("content", [b"", b"nonsense " * 90])
def test_files_that_are_none_are_refused(tmp_path, name, content):
    path = tmp_path / f"a{FORMATS[name].endings[0]}"
    path.write_bytes(content)
    assert format_of(path) is FORMATS[name]
    place = "column: a" if FORMATS[name].tabular else "topic: /a, field: b"
    (tmp_path / "m.yaml").write_text(
        f"time: {{rate_hz: 1}}\nchannels: {{output_angle: {{{place}, unit: rad}}}}\n"
    )
    with pytest.raises(InputError, match=rf"a\{path.suffix}: (cannot be read|it has no channel)"):
        import_recording(path, tmp_path / "m.yaml")


def test_channels_of_several_rates(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    nptdms = pytest.importorskip("nptdms")
    fast, slow = np.arange(101) * 0.01, np.arange(11) * 0.1
    with asammdf.MDF(version="4.10") as file:
        for time, name in ((fast, "a"), (slow, "T")):
            file.append([asammdf.Signal(samples=3 * time, timestamps=time, name=name)])
        file.save(tmp_path / "a.mf4")
    table = format_of(tmp_path / "a.mf4").reader.open_table(tmp_path / "a.mf4")
    values = table.read([table.place(name) for name in ("a", "T", "time")])
    np.testing.assert_allclose(values, [3 * fast, 3 * fast, fast], atol=1e-12)
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(
            [nptdms.ChannelObject(group, "a", values) for group, values in (("g", fast), ("h", slow))]
        )
    table = format_of(tmp_path / "a.tdms").reader.open_table(tmp_path / "a.tdms")
    assert table.names == ("g/a", "h/a")
    with pytest.raises(InputError, match="'g/a' has 101 samples, 'h/a' 11"):
        table.read([0, 1])


def test_sheets_and_dates_of_a_workbook(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    start = datetime.datetime(2024, 7, 11, 12)
    for sheet, factor in ((book.active, 1), (book.create_sheet("second"), 2)):
        sheet.append([None, "when", "a"])
        for k in range(5):
            sheet.append([None, start + datetime.timedelta(milliseconds=20 * k), factor * k])
    book.save(tmp_path / "a.xlsx")
    table = format_of(tmp_path / "a.xlsx").reader.open_table(tmp_path / "a.xlsx")
    when, first, second = table.read([table.place(name) for name in ("when", "a", "second!a")])
    assert np.diff(when).tolist() == 4 * [20_000_000]
    np.testing.assert_array_equal([first, second], [np.arange(5), 2 * np.arange(5)])


def test_matrices_and_structures(tmp_path):
    from scipy.io import savemat

    h5py = pytest.importorskip("h5py")
    matrix = np.arange(30.0).reshape(10, 3)
    savemat(tmp_path / "a.mat", {"log": {"q": matrix}, "wide": matrix.T, "one": 3.0, "text": "x"})
    table = format_of(tmp_path / "a.mat").reader.open_table(tmp_path / "a.mat")
    assert table.names == ("log.q[0]", "log.q[1]", "log.q[2]", "wide[0]", "wide[1]", "wide[2]")
    np.testing.assert_array_equal(table.read(range(6)), [*matrix.T, *matrix.T])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["g/m"] = matrix
        file["t"] = np.array([(1, 2.0), (3, 4.0)], dtype=[("a", "i4"), ("b", "f8")])
    table = format_of(tmp_path / "a.h5").reader.open_table(tmp_path / "a.h5")
    assert table.names == ("g/m[0]", "g/m[1]", "g/m[2]", "t/a", "t/b")
    np.testing.assert_array_equal(table.read([4])[0], [2.0, 4.0])
