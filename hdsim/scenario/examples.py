"""The scenarios that come with hdsim: in a clone the folder ``scenarios``, in a wheel ``hdsim/examples``."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdsim.errors import InputError
from hdsim.scenario.extends import read
from hdsim.scenario.reader import read_node

if TYPE_CHECKING:
    from hdsim.scenario.model import Scenario

#: Subfolder whose files are plain models for ``hdsim diagnose``; what else is below is no scenario.
BASES = "bases"
#: File for editors, beside the scenarios; their first line names it.
SCHEMA = "scenario.schema.json"


def folder() -> Path:
    """Where the examples are.

    Raises:
        InputError: this installation has none.
    """
    package = Path(__file__).parents[1]
    for place in (package / "examples", package.parent / "scenarios"):
        if place.is_dir():
            return place
    raise InputError(f"no examples beside {package}: this installation of hdsim is not complete")


def examples() -> dict[str, Path]:
    """The examples by name: scenarios, then the bases as ``bases/NAME``."""
    home = folder()
    found = [*sorted(home.glob("*.yaml")), *sorted((home / BASES).glob("*.yaml"))]
    return {path.relative_to(home).with_suffix("").as_posix(): path for path in found}


def path_of(name: str) -> Path:
    """The file of an example.

    Raises:
        InputError: there is none of this name; the message has the nearest, or all.
    """
    known = examples()
    if name not in known:
        near = get_close_matches(name, known, 1)
        hint = f"; did you mean {near[0]!r}?" if near else f"; there are: {', '.join(known)}"
        raise InputError(f"no example {name!r}{hint}")
    return known[name]


def example(name: str) -> Scenario:
    """A scenario that comes with hdsim; ``hdsim examples`` lists them.

    >>> hdsim.example("move_and_settle")

    Raises:
        InputError: there is none of this name.
    """
    from hdsim.scenario.model import Scenario

    return Scenario.from_yaml(path_of(name))


def description(path: Path) -> str:
    """What a scenario says of itself, its first paragraph on one line; the name where it has no more."""
    data: dict[str, Any] = read(path).data
    return " ".join(str(data.get("description") or data.get("name", "")).split("\n\n")[0].split())


def copy(name: str, out: Path | None = None) -> list[Path]:
    """Copy an example, what it extends, and the schema for editors; nothing is overwritten.

    Args:
        name: of an example.
        out: the file to write, ``.yaml``; the example's own file name in the current folder when None.

    Returns:
        The files that were written, the copy first. A file that is there already with the same content, and a
        schema of whatever content, is left as it is.

    Raises:
        InputError: no such example, or a file that is in the way or cannot be written.
    """
    from hdsim.scenario.model import Scenario
    from hdsim.scenario.schema import json_schema

    source = path_of(name)
    out = Path(source.name) if out is None else out
    if out.suffix != ".yaml":
        raise InputError(f"{out}: expected a file name that ends in .yaml")
    text = source.read_text(encoding="utf-8")
    first = f"# yaml-language-server: $schema={SCHEMA}\n"
    texts = {out: text if text.startswith(first) else first + text}
    for base in _bases(source):
        if base.name == out.name:
            raise InputError(f"{out}: what the example extends has this name; give another one")
        texts[out.parent / base.name] = base.read_text(encoding="utf-8")
    for path, text in list(texts.items()):
        if path.exists():
            if path == out or path.read_text(encoding="utf-8") != text:
                raise InputError(f"{path} is there already; give another file name or folder")
            del texts[path]
    schema = out.parent / SCHEMA
    if not schema.exists():
        texts[schema] = json.dumps(json_schema(Scenario), indent=1) + "\n"
    return [write(path, text) for path, text in texts.items()]


def _bases(path: Path) -> list[Path]:
    """The files that a scenario extends, nearest first."""
    extends = read_node(path).value.get("extends")
    if extends is None:
        return []
    base = path.parent / str(extends.value)
    return [base, *_bases(base)]


def write(path: Path, text: str) -> Path:
    """Write a file whole or not at all; its folder is made.

    Raises:
        InputError: it cannot be written.
    """
    partial = path.with_name(path.name + ".partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, path)
    except OSError as error:
        with suppress(OSError):
            partial.unlink()
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error
    return path
