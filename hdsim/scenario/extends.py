"""``extends: other.yaml``: a scenario that states only what differs from another one."""

from __future__ import annotations

import os
from pathlib import Path

from hdsim.scenario.problems import Mark, describe
from hdsim.scenario.reader import Node, Source, fail, flatten, problem_of_file, read_node

#: Keys that choose which other keys a mapping has; when one changes, the base's other keys are void.
DISCRIMINATORS = ("type", "law", "model", "kind")
#: Longest chain of files.
MAX_CHAIN = 16


def read(path: str | Path) -> Source:
    """Read a YAML file and all that it extends.

    Mappings merge key by key; lists and scalars replace; ``null`` removes what the base has. When
    ``type``, ``law``, ``model`` or ``kind`` of a mapping changes, nothing else of the base's mapping is kept.

    Raises:
        ScenarioError: a file cannot be read, is not plain YAML, or the chain bites its tail.
    """
    return flatten(read_tree(path))


def read_tree(path: str | Path) -> Node:
    """The same as a tree of nodes that know where they were written."""
    return _read(Path(path), [])


def _read(path: Path, chain: list[str]) -> Node:
    return resolve_extends(read_node(path), path, chain)


def resolve_extends(node: Node, path: Path, chain: list[str]) -> Node:
    """Lay a mapping that was written in ``path`` over what its ``extends`` names; removes that key.

    Args:
        node: a mapping.
        path: file in which it is written; the base is looked for relative to it.
        chain: real paths of the files that led here, to find circles.
    """
    extends = node.value.pop("extends", None)
    if extends is None or extends.value is None:
        return node
    here: Mark = extends.mark
    if not isinstance(extends.value, str) or not extends.value.strip():
        found = describe(flatten(extends).data)
        raise fail(here, f"found {found}, expected the path of another scenario", ("extends",))
    chain = [*chain, os.path.realpath(path)]
    base = Path(os.path.normpath(path.parent / extends.value))
    if problem := problem_of_file(base):
        raise fail(here, f"{problem} ({describe(extends.value)})", ("extends",))
    if os.path.realpath(base) in chain:
        raise fail(
            here,
            f"found {describe(extends.value)}, which extends this file, expected no circle",
            ("extends",),
        )
    if len(chain) >= MAX_CHAIN:
        raise fail(
            here, f"found a chain of more than {MAX_CHAIN} files, expected a shorter one", ("extends",)
        )
    return merge(_read(base, chain), node)


def merge(base: Node, change: Node) -> Node:
    """``change`` laid over ``base``; neither is altered."""
    if not (isinstance(base.value, dict) and isinstance(change.value, dict)):
        return change
    merged: dict[str, Node] = {} if _changes_kind(base.value, change.value) else dict(base.value)
    for key, node in change.value.items():
        if node.value is None and key in base.value:
            merged.pop(key, None)
        elif key in merged:
            merged[key] = merge(merged[key], node)
        else:
            merged[key] = node
    return Node(merged, change.mark)


def _changes_kind(base: dict[str, Node], change: dict[str, Node]) -> bool:
    return any(
        key in base and key in change and base[key].value != change[key].value for key in DISCRIMINATORS
    )
