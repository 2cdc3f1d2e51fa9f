"""Reads a YAML file into plain data that knows the file and line of every value.

The parser is ruamel.yaml's; values follow the core schema of YAML 1.2.2 (section 10.3.2), so ``yes`` is
text and ``010`` is ten. What a scenario has no use for is refused: anchors and aliases (a few lines of
them can expand to gigabytes), tags, several documents, infinite numbers.
"""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from hdsim.scenario.problems import Mark, Problem, ScenarioError, describe, dotted, shorten

#: Largest file that is read, in bytes; longer tables belong into a CSV file.
MAX_BYTES = 1_000_000
#: Deepest nesting of mappings and lists.
MAX_DEPTH = 32

Key = str | int
KeyPath = tuple[Key, ...]

_NULL = re.compile(r"~|null|Null|NULL|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\x80-\x84\x86-\x9f\ufffe\uffff]")


@dataclass
class Node:
    """A value and where it was written: a mapping or list of nodes, or a scalar."""

    value: Any
    mark: Mark


@dataclass(frozen=True)
class Source:
    """Plain data and the place of every value in it; ``marks[()]`` is the whole."""

    data: dict[str, Any]
    marks: dict[KeyPath, Mark]

    def mark(self, path: KeyPath) -> Mark:
        """Where the value at ``path`` was written, or the nearest value that encloses it."""
        while path not in self.marks:
            path = path[:-1]
        return self.marks[path]


def flatten(root: Node) -> Source:
    """Split a tree of nodes into plain data and the map of places."""
    marks: dict[KeyPath, Mark] = {}

    def plain(node: Node, path: KeyPath) -> Any:
        marks[path] = node.mark
        if isinstance(node.value, dict):
            return {key: plain(child, (*path, key)) for key, child in node.value.items()}
        if isinstance(node.value, list):
            return [plain(child, (*path, index)) for index, child in enumerate(node.value)]
        return node.value

    return Source(plain(root, ()), marks)


def read_node(path: Path) -> Node:
    """Read one YAML file, without following ``extends``.

    Raises:
        ScenarioError: the file is missing, is no regular file, is not UTF-8, too large, too deep, or not
            the plain YAML described above.
    """
    text = _read_text(path)
    return parse(text, str(path))


def fail(mark: Mark, text: str, path: KeyPath = ()) -> ScenarioError:
    """The error of a single problem."""
    return ScenarioError([Problem(mark, dotted(path), text)])


def problem_of_file(path: Path) -> str | None:
    """Why ``path`` cannot be read as a file, as ``found ..., expected ...``, or None."""
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        try:
            near = get_close_matches(path.name, os.listdir(path.parent), 1)
        except OSError:
            near = []
        return "found no such file, expected an existing file" + (f" such as '{near[0]}'" if near else "")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        return f"found a path that cannot be opened ({reason}), expected an existing file"
    if stat.S_ISDIR(mode):
        return "found a directory, expected a file"
    if not stat.S_ISREG(mode):
        return "found a device or pipe, expected a file"
    return None


def _read_text(path: Path) -> str:
    whole = Mark(str(path))
    if problem := problem_of_file(path):
        raise fail(whole, problem)
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise fail(
            whole, f"found a file that cannot be read ({error.strerror}), expected a readable one"
        ) from error
    if len(raw) > MAX_BYTES:
        raise fail(
            whole, f"found more than {MAX_BYTES} bytes, expected a scenario (put long tables into a CSV file)"
        )
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        mark = Mark(str(path), 1 + raw.count(b"\n", 0, error.start))
        raise fail(mark, f"found the byte 0x{raw[error.start]:02x}, expected YAML text in UTF-8") from error
    if control := _CONTROL.search(text):
        mark = Mark(str(path), 1 + text.count("\n", 0, control.start()))
        raise fail(mark, f"found the control character U+{ord(control[0]):04X}, expected YAML text")
    return text


def _events(text: str, file: str) -> Iterator[Any]:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        yield from YAML(typ="safe", pure=True).parse(text)
    except (YAMLError, AssertionError) as error:
        # The parser asserts that a %YAML directive names a version that it knows.
        raise _syntax_error(error, text, file) from error


def _syntax_error(error: Exception, text: str, file: str) -> ScenarioError:
    """Say a parser's complaint in the user's words."""
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    number = mark.line if mark else 0
    lines = text.split("\n")
    written = lines[number] if number < len(lines) else ""
    problem = getattr(error, "problem", None) or str(error).split("\n")[0]
    context = getattr(error, "context", None)
    if re.match(r" *\t", written):
        return fail(Mark(file, number + 1), "found a tab in the indentation, expected spaces")
    if "mapping values are not allowed" in problem:
        complaint = "a ':' where no key can stand (wrong indentation, or text with ': ' that needs quotes)"
    elif "end of stream" in problem or "stream end" in problem:
        begun = getattr(error, "context_mark", None) or mark
        number = begun.line if begun else number
        complaint = "something that begins here and is not closed before the end of the file"
    elif "cannot start any token" in problem:
        complaint = problem.removeprefix("found ").replace("'\\t'", "tab") + " (put text with it in quotes)"
    else:
        complaint = f"{problem} {context}" if context else problem
        complaint = complaint.removeprefix("found ")
    return fail(Mark(file, number + 1), f"found {shorten(ascii(complaint)[1:-1], 160)}, expected valid YAML")


def parse(text: str, file: str) -> Node:
    """Build the tree from the parser's events; a loop, so that no nesting exhausts Python's stack."""
    from ruamel.yaml import events

    stack: list[_Open] = []
    root: Node | None = None
    documents = 0
    for event in _events(text, file):
        mark = Mark(file, event.start_mark.line + 1)
        top = stack[-1] if stack else None
        path = top.path_of_next() if top is not None else ()
        if isinstance(event, events.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise fail(mark, "found a second document ('---'), expected one document a file")
            continue
        if isinstance(event, events.MappingEndEvent | events.SequenceEndEvent):
            stack.pop()
            continue
        if not isinstance(event, events.NodeEvent):
            continue
        if isinstance(event, events.AliasEvent) or event.anchor is not None:
            sign = "*" if isinstance(event, events.AliasEvent) else "&"
            name = shorten(ascii(event.anchor)[1:-1])
            raise fail(
                mark, f"found {sign}{name}, expected no anchors and aliases (share by 'extends')", path
            )
        tag = getattr(event, "tag", None)
        if tag is not None:
            raise fail(mark, f"found the tag {shorten(ascii(tag)[1:-1])}, expected a value without tag", path)
        if top is not None and top.awaits_key:
            top.set_key(event, mark, path)
            continue
        if isinstance(event, events.ScalarEvent):
            node = Node(_scalar(event, mark, path), mark)
        else:
            if len(stack) >= MAX_DEPTH:
                raise fail(mark, f"found more than {MAX_DEPTH} levels of nesting, expected a scenario")
            node = Node({} if isinstance(event, events.MappingStartEvent) else [], mark)
        if top is None:
            root = node
        else:
            top.add(node)
        if not isinstance(node.value, dict | list):
            continue
        stack.append(_Open(node, path))
    if root is None or root.value is None:
        raise fail(Mark(file, 1), "found an empty file, expected a mapping of 'key: value' lines")
    if not isinstance(root.value, dict):
        found = describe(flatten(root).data)
        raise fail(root.mark, f"found {found}, expected a mapping of 'key: value' lines")
    return root


class _Open:
    """A mapping or list whose end has not been read."""

    def __init__(self, node: Node, path: KeyPath) -> None:
        self.node = node
        self.path = path
        self.key: str | None = None
        self.key_mark = node.mark

    @property
    def awaits_key(self) -> bool:
        return isinstance(self.node.value, dict) and self.key is None

    def path_of_next(self) -> KeyPath:
        if isinstance(self.node.value, list):
            return (*self.path, len(self.node.value))
        return self.path if self.key is None else (*self.path, self.key)

    def set_key(self, event: Any, mark: Mark, path: KeyPath) -> None:
        from ruamel.yaml.events import ScalarEvent

        if not isinstance(event, ScalarEvent):
            raise fail(mark, "found a mapping or list as a key, expected text", path)
        if event.value in self.node.value:
            first = self.node.value[event.value].mark.line
            raise fail(
                mark,
                f"found this key again (first in line {first}), expected every key once",
                (*path, event.value),
            )
        self.key, self.key_mark = event.value, mark

    def add(self, node: Node) -> None:
        if isinstance(self.node.value, list):
            self.node.value.append(node)
            return
        if self.key is None:
            raise AssertionError("a value without key")
        if isinstance(node.value, dict | list) or node.value is None:
            node.mark = self.key_mark
        self.node.value[self.key] = node
        self.key = None


def _scalar(event: Any, mark: Mark, path: KeyPath) -> str | int | float | bool | None:
    text: str = event.value
    if event.style is not None:
        return text
    if _NOT_FINITE.fullmatch(text):
        raise fail(mark, f"found {text}, expected a finite number", path)
    if _INT.fullmatch(text) and len(text) > 300:
        raise fail(mark, f"found a number of {len(text)} digits, expected one of reasonable length", path)
    value = resolve(text)
    if isinstance(value, float) and not math.isfinite(value):
        raise fail(mark, f"found {shorten(text)}, which overflows, expected a finite number", path)
    return value


def resolve(text: str) -> str | int | float | bool | None:
    """Value of a scalar without quotes, by YAML 1.2.2's core schema (table of section 10.3.2)."""
    if _NULL.fullmatch(text):
        return None
    if _BOOL.fullmatch(text):
        return text[0] in "tT"
    if _INT.fullmatch(text):
        return int(text, 0) if text[:2] in ("0o", "0x") else int(text)
    if _FLOAT.fullmatch(text) or _NOT_FINITE.fullmatch(text):
        return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    return text
