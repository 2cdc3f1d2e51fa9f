"""Writing a recording that is whole already."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdsim.log import naming
from hdsim.log.view import VIEW_SAMPLES, view_rate
from hdsim.log.writer import LogWriter
from hdsim.recording import Table

if TYPE_CHECKING:
    from hdsim.recording import Recording


def write_log(
    recording: Recording,
    path: str | Path,
    *,
    attachments: Mapping[str, bytes | str] | None = None,
    scene: bool = True,
) -> Path:
    """Write a whole recording.

    Args:
        recording: what to write; arrays come back bit by bit from `hdsim.log.open_log`.
        path: where to.
        attachments: file names to contents. The text under ``scenario`` in the metadata is attached as
            ``scenario.yaml`` unless there is an attachment of that name.
        scene: draw the drive, if the state has the angles of motor and output.

    Returns:
        The log's path.
    """
    files = dict(attachments or {})
    if "scenario" in recording.metadata:
        files.setdefault("scenario.yaml", recording.metadata["scenario"])
    measured = recording.metadata.get(naming.ORIGIN_KEY) == naming.MEASURED
    longest = max((recording.tables.get(name, Table(np.zeros(0))) for name in naming.VIEWED_TABLES), key=len)
    rate = np.inf
    if len(longest) > VIEW_SAMPLES:
        rate = view_rate(float(longest.time[-1] - longest.time[0]))
    with LogWriter(path, metadata=recording.metadata, attachments=files, view_rate_hz=rate) as log:
        log.write_static(recording.static)
        for event in recording.events:
            log.write_event(event)
        for name, table in recording.tables.items():
            log.write(naming.MEASURED if measured and name == "state" else name, table)
        if scene:
            from hdsim.log.scene import write_scene

            write_scene(log, recording)
    return Path(path)
