"""The columns of a file, with the numbers of its beginning."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.log.guess.findings import Candidate
from hdsim.log.guess.words import meaning
from hdsim.log.mapping import Form, Origin
from hdsim.log.readers import format_of
from hdsim.log.readers.contract import Numbers, Table, Tell, silent
from hdsim.log.readers.topics import Messages, fields_of, read_topics

#: Most numbers that are looked at, over all columns: 160 MB.
MOST_NUMBERS = 20_000_000
_FEWEST = 3
#: Units of sensor_msgs/JointState, by its definition (for revolute joints).
_OF_JOINTS = {"position": "rad", "velocity": "rad/s", "effort": "Nm"}


@dataclass(frozen=True)
class Survey:
    """What a file holds.

    Args:
        columns: those with numbers, all of one length n.
        notes: what is to be told of the file's form.
        topic: of messages: the topic with the most of them, whose times count; "" for a table.
        stamps: its times (n,) in s.
    """

    columns: list[Candidate]
    notes: list[str]
    topic: str = ""
    stamps: NDArray[np.float64] | None = None


def survey(path: Path, form: Form | None = None, tell: Tell = silent) -> Survey:
    """Look at a file.

    Args:
        path: the file.
        form: how it is to be read, as far as the user says.
        tell: hears how far the reading is.

    Raises:
        InputError: it cannot be read, or holds too little.
    """
    kind = format_of(path, form)
    if not kind.tabular:
        return _messages(path, kind.title, kind.reader.messages)
    table: Table = kind.reader.open_table(path, form)
    rows = max(MOST_NUMBERS // max(len(table.names), 1), 1000)
    found, left_out = [], []
    for place, values in _columns(table, rows, tell).items():
        name = table.names[place]
        label = name or f"column {place + 1}"
        if values is None:
            left_out.append(label)
            continue
        column = name if name and table.names.count(name) == 1 else place + 1
        said = meaning(name, table.units.get(place, ""))
        found.append(Candidate(Origin(column=column), label, said, values))
    if not found or len(found[0].values) < _FEWEST:
        raise InputError(f"{path}: it holds fewer than {_FEWEST} samples of numbers")
    notes = [f"{kind.title}, {len(table.names)} columns", *table.notes]
    if len(found[0].values) == rows:
        notes.append(f"the first {rows} samples were looked at")
    if left_out:
        notes.append(f"no numbers, or of another length: {', '.join(left_out[:8])}")
    return Survey(found, notes)


def _columns(table: Table, rows: int, tell: Tell) -> dict[int, Numbers | None]:
    """Columns by place; None for those that are no numbers or of another length than most."""
    places = [place for place in range(len(table.names)) if place not in table.words]
    found: dict[int, Numbers | None] = dict.fromkeys(range(len(table.names)))
    try:
        return found | dict(zip(places, table.read(places, rows, tell), strict=True))
    except InputError:
        pass  # one of them is to blame
    for place in places:
        try:
            found[place] = table.read([place], rows)[0]
        except InputError:
            continue
    lengths = [len(values) for values in found.values() if values is not None]
    usual = max(set(lengths), key=lengths.count, default=0)
    return {p: None if values is None or len(values) != usual else values for p, values in found.items()}


def _messages(path: Path, title: str, messages: Messages) -> Survey:
    """Fields of all topics at the times of the topic with the most messages."""
    origins = fields_of(path, messages)
    if not origins:
        raise InputError(f"{path}: no topic has a field that is a number")
    topics = read_topics(path, origins, messages, max(MOST_NUMBERS // len(origins), 1000))
    lead = max(topics, key=lambda topic: len(topics[topic].stamps["log"]))
    start = topics[lead].stamps["log"][0]
    time = 1e-9 * (topics[lead].stamps["log"] - start)
    if len(time) < _FEWEST:
        raise InputError(f"{path}: it holds fewer than {_FEWEST} messages of numbers")
    found = []
    for topic, samples in topics.items():
        own = 1e-9 * (samples.stamps["log"] - start)
        for origin, values in samples.values.items():
            if topic != lead:
                values = np.interp(time, own, values, left=np.nan, right=np.nan)
            joint = f" of {origin.joint}" if origin.joint else ""
            unit = _OF_JOINTS.get(str(origin.field), "") if origin.joint else ""
            words = meaning(" ".join([origin.joint or "", topic.replace("/", " "), origin.field or ""]), unit)
            found.append(Candidate(origin, f"{topic} {origin.field}{joint}", words, values))
    return Survey(found, [f"{title}, {len(topics)} topics"], lead, time)
