"""What a tutorial asks its reader to do: files to save, commands to type, and what they print.

A block of YAML or Python whose first line is ``# name.ext`` is a file; a block of ``bash`` holds commands,
one a line; a block of ``text`` after it shows lines of what they print, in their order but not all of them.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAME = re.compile(r"# ([\w-]+\.(?:yaml|py))\n")
NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


@dataclass
class Step:
    """Files to save, then commands, then lines that they print."""

    files: dict[str, str] = field(default_factory=dict)
    commands: list[str] = field(default_factory=list)
    shown: list[str] = field(default_factory=list)


def steps(page: Path) -> list[Step]:
    """The steps of a tutorial, in order."""
    found = [Step()]
    for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if language == "text":
            found[-1].shown += text.splitlines()
            continue
        if found[-1].commands:
            found.append(Step())
        if language == "bash":
            found[-1].commands += text.splitlines()
        elif name := NAME.match(text):
            found[-1].files[name[1]] = text
    return found


def follow(step: Step, folder: Path) -> str:
    """Do a step in a folder; what its commands print.

    Raises:
        RuntimeError: a command fails, with what it says.
    """
    for name, text in step.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return "".join(_run(command, folder) for command in step.commands)


def _run(command: str, folder: Path) -> str:
    program, *arguments = shlex.split(command)
    given = {"hdsim": [sys.executable, "-m", "hdsim"], "python": [sys.executable]}[program]
    plain = os.environ | {"NO_COLOR": "1", "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(
        [*given, *arguments], cwd=folder, env=plain, capture_output=True, text=True, encoding="utf-8"
    )
    if done.returncode:
        raise RuntimeError(f"{command}: {done.stdout}{done.stderr}")
    return done.stdout


def missing(shown: list[str], printed: str, tolerance: float = 0.02) -> Iterator[str]:
    """Lines that are shown and not printed, in this order, with numbers that agree within a tolerance."""
    lines = iter(_read(line) for line in printed.splitlines())
    for line in shown:
        words, numbers = _read(line)
        for other, values in lines:
            same = other.startswith(words) and len(values) >= len(numbers)
            if same and all(abs(a - b) <= tolerance * abs(a) for a, b in zip(numbers, values, strict=False)):
                break
        else:
            yield line


def _read(line: str) -> tuple[str, list[float]]:
    """Words of a line with its spaces, frames and numbers made alike, and its numbers."""
    numbers = [float(number) for number in NUMBER.findall(line)]
    return " ".join(NUMBER.sub("#", re.sub(r"[┃│]", "|", line)).split()), numbers
