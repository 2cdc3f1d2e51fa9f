"""Mappings and files that are wrong are told with their place."""

import pytest
from foreign import ANGLE, BASE, TIME, simple

from hdsim.errors import InputError
from hdsim.log.importing import import_recording


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("column: a,", "column: angel,", "no column 'angel'"),
        ("column: a, unit: rad", "column: a", "m.yaml:2: channels.output_angle.unit"),
        ("unit: rad", "unit: N m", "m.yaml:2: channels.output_angle.unit"),
        ("unit: rad", "unit: rad, side: input", "'motor', 'output'"),
        ("unit: rad", "unit: rad, side: motor", "that needs the ratio"),
        ("unit: rad", "unit: count", "needs counts_per_turn"),
        ("unit: rad", "unit: rad, sign: 2", "sign"),
        ("output_angle", "output_angel", "output_angle"),
        ("column: a,", "topic: /a, field: b,", "names topic '/a'"),
        ("unit: s}", "unit: s}\nratio: 0.5", "at least 1"),
        ("column: t, unit: s", "stamp: log", "neither a column nor a rate_hz"),
        ("column: t, unit: s", "column: t", "needs its unit"),
        (
            "unit: s}",
            "unit: s}\nmasks: [{type: outliers, channels: [motor_angle]}]",
            "mapped are: output_angle",
        ),
    ],
)
def test_a_wrong_mapping_is_told_with_its_place(tmp_path, old, new, expected):
    with pytest.raises(InputError) as error:
        simple(tmp_path, TIME, ANGLE, BASE.replace(old, new))
    assert expected in str(error.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "it is empty"),
        ("t,a\n", "it is empty"),
        ("t,a\n0,1\n", "one sample is no recording"),
        ("t,a\n0,1\n1,x\n", "a.csv:3: column 'a': found 'x', expected a number"),
        ("t,a\n0,1\n1\n", "a.csv:3: the line has 1 cells"),
        ("t,a\n0,1\n1,1\n1,2\n", "sample 3 at 1 s follows 1 s"),
        ("t,a\n0,1\n,1\n", "sample 2 has no time"),
        ("\x00\xff", "a.csv"),
    ],
)
def test_a_wrong_file_is_told(tmp_path, text, expected):
    (tmp_path / "m.yaml").write_text(BASE)
    (tmp_path / "a.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError) as error:
        import_recording(tmp_path / "a.csv", tmp_path / "m.yaml")
    assert expected in str(error.value)


def test_files_that_are_not_what_they_seem(tmp_path):
    (tmp_path / "m.yaml").write_text(
        BASE.replace("column: a", "topic: /a, field: b").replace("column: t, unit: s", "")
    )
    for name in ("a.mcap", "a.xyz", "bag.db3"):
        (tmp_path / name).write_text("nonsense")
        with pytest.raises(InputError, match=name.split(".")[0]):
            import_recording(tmp_path / name, tmp_path / "m.yaml")
    with pytest.raises(InputError, match="no such file"):
        import_recording(tmp_path / "nowhere.csv", tmp_path / "m.yaml")
    (tmp_path / "c.yaml").write_text(BASE)
    (tmp_path / "p.parquet").write_text("nonsense")
    with pytest.raises(InputError, match="cannot be read as Parquet"):
        import_recording(tmp_path / "p.parquet", tmp_path / "c.yaml")
