"""What is found out about a file, each with its ground."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from hdsim.log.guess.words import Meaning
from hdsim.log.mapping import Origin
from hdsim.log.readers.contract import Numbers


class Ground(StrEnum):
    """Why something is believed, the best first."""

    SAID = "said"
    """The user says so."""
    STATED = "stated"
    """The file says so in words."""
    SHOWN = "shown"
    """No other choice agrees with the numbers."""
    ASSUMED = "assumed"
    """The numbers leave a choice; this is the usual one."""
    OPEN = "open"
    """Nothing tells."""


@dataclass(frozen=True)
class Answer:
    """A value for a key of the mapping, and why.

    Args:
        value: None where it is open.
        ground: see `Ground`.
        why: one line.
    """

    value: Any
    ground: Ground
    why: str = ""


@dataclass(eq=False)
class Candidate:
    """A column (or field of a topic) and what is known of it.

    Args:
        origin: where it is.
        label: its name, as the user knows it.
        meaning: what the name says.
        values: its numbers (n,), all of them or the first.
        said: what the user has said about it, by key.
    """

    origin: Origin
    label: str
    meaning: Meaning
    values: Numbers
    said: dict[str, str] = field(default_factory=dict)

    @property
    def quantity(self) -> str:
        """The quantity that the user or the name says."""
        channel = self.said.get("channel", "")
        return channel.rsplit("_", 1)[-1] if channel else self.meaning.quantity


@dataclass
class Channel:
    """A channel of the draft: where it is, and its keys.

    Args:
        source: the column.
        keys: answers by the mapping's key: unit, side, sign, ...
        why: why this column is this channel.
        ground: how sure that is.
    """

    source: Candidate
    keys: dict[str, Answer]
    why: str
    ground: Ground = Ground.STATED

    @property
    def open(self) -> bool:
        """Whether something is left to be said before it can be imported."""
        return self.ground == Ground.OPEN or any(a.ground == Ground.OPEN for a in self.keys.values())


@dataclass(frozen=True)
class Question:
    """What is left to be said.

    Args:
        text: what it is.
        key: how ``--set`` calls it, or "" where nothing that can be said would help.
        example: an answer.
    """

    text: str
    key: str = ""
    example: str = ""

    def __str__(self) -> str:
        return f"{self.text}: --set '{self.key}={self.example}'" if self.key else self.text


@dataclass
class Draft:
    """A mapping in the making.

    Args:
        title: name of the file.
        notes: what was found of the file's form.
        time: keys of the mapping's time.
        ratio: the ratio, or None where nothing needs it.
        channels: by name.
        unused: columns that are not mapped, and why.
        open: what is left to be said.
        peak_output_nm: largest torque at the output that was seen, N m, for the base scenario.
        longest_gap_s: of the mapping, where there are gaps.
        masks: of the mapping, each a dictionary of its keys.
    """

    title: str
    notes: list[str] = field(default_factory=list)
    time: dict[str, Answer] = field(default_factory=dict)
    ratio: Answer | None = None
    channels: dict[str, Channel] = field(default_factory=dict)
    unused: dict[str, str] = field(default_factory=dict)
    open: list[Question] = field(default_factory=list)
    peak_output_nm: float | None = None
    longest_gap_s: Answer | None = None
    masks: list[Answer] = field(default_factory=list)

    def ask(self, text: str, key: str = "", example: str = "") -> None:
        """Leave something open."""
        self.open.append(Question(text, key, example))
