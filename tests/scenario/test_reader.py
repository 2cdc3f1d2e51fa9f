# ruff: noqa: E501 (one case a line reads best)
"""The reader: plain YAML in, values with file and line out, everything else refused in one line."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hdsim.scenario.extends import read
from hdsim.scenario.problems import ScenarioError
from hdsim.scenario.reader import MAX_BYTES
from hdsim.scenario.writer import to_yaml

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a]\nc: [*b, *b, *b, *b, *b]\n"

REFUSED = {
    "empty": (b"", 1, "found an empty file"),
    "comment only": (b"# nothing\n\n", 1, "found an empty file"),
    "null": (b"~\n", 1, "found an empty file"),
    "binary": (bytes(range(128, 256)), 1, "found the byte 0x80"),
    "bad byte in line 3": (b"a: 1\nb: 2\nc: \xff\n", 3, "found the byte 0xff"),
    "utf-16": ("a: 1\n".encode("utf-16"), 1, "UTF-8"),
    "null bytes": (b"a: 1\nb: \x00\n", 2, "control character U+0000"),
    "tab": (b"a:\n\tb: 1\n", 2, "found a tab in the indentation, expected spaces"),
    "tab after spaces": (b"a:\n  b: 1\n  \tc: 1\n", 3, "found a tab in the indentation"),
    "colon in a value": (b"a: 1\nb: x: y\n", 2, "a ':' where no key can stand"),
    "bad indentation": (b"a: 1\n   b: 2\n", 2, "a ':' where no key can stand"),
    "open bracket": (b"a: 1\nb: [1, 2\n", 2, "begins here and is not closed"),
    "open quote": (b"a: 'x\n", 1, "not closed"),
    "bad start": (b"a: @x\n", 1, "put text with it in quotes"),
    "bad escape": (b'a: "\\q"\n', 1, "unknown escape"),
    "top-level list": (b"- 1\n- 2\n", 1, "found a list of 2, expected a mapping"),
    "top-level text": (b"hello\n", 1, "found 'hello' (text), expected a mapping"),
    "duplicate key": (b"a: 1\nb:\n  c: 1\n  c: 2\n", 4, "b.c: found this key again (first in line 3)"),
    "alias bomb": (BOMB.encode(), 1, "a: found &a, expected no anchors and aliases"),
    "alias": (b"a: *b\n", 1, "a: found *b"),
    "merge key": (b"a: {x: 1}\nb:\n  <<: *a\n", 3, "found *a"),
    "own tag": (b"a:\n  b: !secret x\n", 2, "a.b: found the tag !secret"),
    "python tag": (b"a: !!python/object/apply:os.system [ls]\n", 1, "found the tag"),
    "infinite": (b"a:\n  - 1\n  - .inf\n", 3, "a[1]: found .inf, expected a finite number"),
    "not a number": (b"a: .nan\n", 1, "a: found .nan"),
    "overflow": (b"a: 1e999\n", 1, "a: found 1e999, which overflows"),
    "endless digits": (b"a: " + b"9" * 5000 + b"\n", 1, "a number of 5000 digits"),
    "two documents": (b"a: 1\n---\nb: 2\n", 2, "found a second document"),
    "deep": (b"a: " + b"[" * 5000 + b"]" * 5000, 1, "levels of nesting"),
    "deep block": (b"".join(b" " * k + b"a:\n" for k in range(60)), 33, "levels of nesting"),
    "list as a key": (b"? [1, 2]\n: 3\n", 1, "found a mapping or list as a key"),
    "other version": (b"%YAML 9.9\n---\na: 1\n", 1, "version"),
}  # fmt: skip


def message_of(path: Path) -> str:
    with pytest.raises(ScenarioError) as caught:
        read(path)
    text = str(caught.value)
    assert "\n" not in text
    return text


def refusal_of(path: Path) -> str | None:
    try:
        read(path)
    except ScenarioError as error:
        return str(error)
    return None


@pytest.mark.parametrize(("content", "line", "part"), REFUSED.values(), ids=REFUSED.keys())
def test_what_is_no_plain_yaml_is_refused_with_its_line(
    tmp_path: Path, content: bytes, line: int, part: str
) -> None:
    path = tmp_path / "x.yaml"
    path.write_bytes(content)
    text = message_of(path)
    assert text.startswith(f"{path}:{line}: ")
    assert part in text


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "seed.yaml").write_text("a: 1\n")
    os.mkfifo(tmp_path / "pipe")
    assert message_of(tmp_path) == f"{tmp_path}: found a directory, expected a file"
    assert "such as 'seed.yaml'" in message_of(tmp_path / "sed.yaml")
    assert "device or pipe" in message_of(tmp_path / "pipe")
    assert "cannot be opened" in message_of(tmp_path / ("x" * 5000))
    assert "cannot be opened" in message_of(Path("a\0b"))


def test_a_huge_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_bytes(b"#" * (MAX_BYTES + 1))
    assert f"more than {MAX_BYTES} bytes" in message_of(path)


def test_scalars_follow_the_core_schema_of_yaml_1_2(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text("[]: 1\n".replace("[]", "a") + "b: [010, 0o10, 0x1F, -1, +2, 1e3, .5, 5., yes, on, 1_0, 12:30]\n"
                    "c: [true, False, ~, null, '1', \"2\", 2020-01-01]\nd: |\n  two\n  lines\n")  # fmt: skip
    data = read(path).data
    assert data["b"] == [10, 8, 31, -1, 2, 1000.0, 0.5, 5.0, "yes", "on", "1_0", "12:30"]
    assert data["c"] == [True, False, None, None, "1", "2", "2020-01-01"]
    assert data["d"] == "two\nlines\n"


def test_every_value_knows_its_line(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text("a: 1\nb:\n  c:\n    - 1\n    - {d: 2,\n       e: 3}\n  f:\n")
    marks = read(path).marks
    lines = {key: mark.line for key, mark in marks.items()}
    assert lines == {
        (): 1, ("a",): 1, ("b",): 2, ("b", "c"): 3, ("b", "c", 0): 4, ("b", "c", 1): 5,
        ("b", "c", 1, "d"): 5, ("b", "c", 1, "e"): 6, ("b", "f"): 7,
    }  # fmt: skip


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass"))
)
def test_random_bytes_are_read_or_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.yaml"
    path.write_bytes(content)
    refusal = refusal_of(path)
    assert refusal is None or ("found" in refusal and "\n" not in refusal)


YAML_PIECES = st.sampled_from(
    ["a", "b: ", ": ", "- ", "\n", "\n  ", "\n    ", "[", "]", "{", "}", ", ", "'", '"', "|", ">", "&x ", "*x", "!t ",
     "1", "-2.5e3", ".nan", "~", "#c", "?", "%", "---", "...", "\t", "<<", "!!str ", "\\", "@", "`", "é", "\u2028", "0x",
     "%YAML 1.1", "%TAG ! a", "\r", "|-2", ">+", "!", "!<", "&", "*"]
)  # fmt: skip


@settings(deadline=None, max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(YAML_PIECES, max_size=30).map("".join))
def test_random_yaml_is_read_or_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(text, encoding="utf-8", newline="")
    refusal = refusal_of(path)
    assert refusal is None or ("found" in refusal and "\n" not in refusal)


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63) | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=30) | st.from_regex(r"[-+.0-9eExob_:]{1,8}", fullmatch=True),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8, alphabet="abc_1é:- "), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(st.text(min_size=1, max_size=6, alphabet="abcdef"), PLAIN, min_size=1, max_size=4))
def test_what_is_written_is_read_back_the_same(tmp_path: Path, data: dict[str, object]) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(to_yaml(data), encoding="utf-8", newline="")
    assert repr(read(path).data) == repr(data)
