"""``extends``: one scenario laid over another."""

from __future__ import annotations

from pathlib import Path

import pytest

from hdsim.scenario.extends import MAX_CHAIN, read
from hdsim.scenario.problems import ScenarioError


def write(folder: Path, **files: str) -> None:
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text)


def message_of(path: Path) -> str:
    with pytest.raises(ScenarioError) as caught:
        read(path)
    return str(caught.value)


def test_mappings_merge_and_lists_and_scalars_are_replaced(tmp_path: Path) -> None:
    write(
        tmp_path,
        base="a: 1\nb: {c: 1, d: [1, 2, 3], e: {f: 1}}\n",
        top="extends: base.yaml\nb: {d: [4], e: {g: 2}}\nh: 5\n",
    )
    assert read(tmp_path / "top.yaml").data == {
        "a": 1,
        "b": {"c": 1, "d": [4], "e": {"f": 1, "g": 2}},
        "h": 5,
    }


def test_null_removes_what_the_base_has_and_stays_where_it_has_nothing(tmp_path: Path) -> None:
    write(tmp_path, base="a: {b: 1, c: {d: 2}}\n", top="extends: base.yaml\na: {c: null, e: null}\n")
    assert read(tmp_path / "top.yaml").data == {"a": {"b": 1, "e": None}}


@pytest.mark.parametrize("key", ["type", "law", "model", "kind"])
def test_another_kind_drops_the_siblings_of_the_base(tmp_path: Path, key: str) -> None:
    write(
        tmp_path,
        base=f"a: {{{key}: sine, amplitude: 1, mean: 2}}\n",
        other=f"extends: base.yaml\na: {{{key}: step, height: 3}}\n",
        same=f"extends: base.yaml\na: {{{key}: sine, mean: 3}}\n",
    )
    assert read(tmp_path / "other.yaml").data == {"a": {key: "step", "height": 3}}
    assert read(tmp_path / "same.yaml").data == {"a": {key: "sine", "amplitude": 1, "mean": 3}}


def test_a_chain_crosses_folders_and_values_remember_their_file(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    write(tmp_path, first="a: 1\nb: 1\nc: 1\n")
    write(tmp_path / "deep", second="extends: ../first.yaml\nb: 2\nc: 2\n")
    write(tmp_path, third="extends: deep/second.yaml\n\nc: 3\n")
    source = read(tmp_path / "third.yaml")
    assert source.data == {"a": 1, "b": 2, "c": 3}
    assert [(Path(source.marks[(key,)].file).name, source.marks[(key,)].line) for key in "abc"] == [
        ("first.yaml", 1),
        ("second.yaml", 2),
        ("third.yaml", 3),
    ]


def test_circles_are_refused(tmp_path: Path) -> None:
    write(tmp_path, a="extends: b.yaml\n", b="x: 1\nextends: ./a.yaml\n", own="extends: own.yaml\n")
    assert message_of(tmp_path / "own.yaml").startswith(f"{tmp_path}/own.yaml:1: extends: found 'own.yaml'")
    assert message_of(tmp_path / "a.yaml").startswith(f"{tmp_path}/b.yaml:2: extends: found './a.yaml'")
    (tmp_path / "link.yaml").symlink_to(tmp_path / "linked.yaml")
    write(tmp_path, linked="extends: link.yaml\n")
    assert "no circle" in message_of(tmp_path / "linked.yaml")


def test_too_long_a_chain_is_refused(tmp_path: Path) -> None:
    write(tmp_path, f0="x: 1\n", **{f"f{k}": f"extends: f{k - 1}.yaml\n" for k in range(1, MAX_CHAIN + 2)})
    assert "found a chain of more than" in message_of(tmp_path / f"f{MAX_CHAIN + 1}.yaml")
    assert read(tmp_path / f"f{MAX_CHAIN - 1}.yaml").data == {"x": 1}


@pytest.mark.parametrize(
    ("written", "part"),
    [
        ("gone.yaml", "found no such file"),
        (".", "found a directory"),
        ("[a.yaml, b.yaml]", "found a list of 2"),
        ("3", "found 3 (whole number)"),
        ('""', "found '' (text)"),
        ('"a\\0b"', "cannot be opened"),
    ],
)
def test_what_cannot_be_extended_is_refused_where_it_is_named(
    tmp_path: Path, written: str, part: str
) -> None:
    write(tmp_path, top=f"x: 1\nextends: {written}\n")
    text = message_of(tmp_path / "top.yaml")
    assert text.startswith(f"{tmp_path}/top.yaml:2: extends: ")
    assert part in text


def test_an_error_in_the_base_names_the_base(tmp_path: Path) -> None:
    write(tmp_path, base="a: 1\na: 2\n", top="extends: base.yaml\n")
    assert message_of(tmp_path / "top.yaml").startswith(f"{tmp_path}/base.yaml:2: a: found this key again")
