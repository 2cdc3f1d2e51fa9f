"""LabVIEW's TDMS files, by npTDMS; only the channels that are asked for are read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import InputError
from hdsim.log.readers.contract import Numbers, Table, Tell, even, needed, numeric, silent

if TYPE_CHECKING:
    from hdsim.log.mapping import Form

#: The column of a waveform's own time, in s.
TIME = "time"


def open_table(path: Path, form: Form | None = None) -> Table:
    """Open a TDMS file; a column is ``channel``, or ``group/channel`` where two groups have it."""
    tdms = needed("npTDMS", "nptdms", "tdms", "TDMS")
    try:
        file = tdms.TdmsFile.open(path)
    except Exception as error:  # npTDMS says of damaged files whatever went wrong first
        raise InputError(f"{path}: cannot be read as TDMS: {error}") from None
    channels = [channel for group in file.groups() for channel in group.channels() if len(channel)]
    twice = Counter(channel.name for channel in channels)
    names = [c.name if twice[c.name] == 1 else f"{c.group_name}/{c.name}" for c in channels]
    units = {
        k: str(unit)
        for k, channel in enumerate(channels)
        if (unit := channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription"))
    }
    timed = [channel for channel in channels if channel.properties.get("wf_increment")]
    if timed and TIME not in names:
        units[len(names)] = "s"
        names.append(TIME)
    if not names:
        raise InputError(f"{path}: it has no channel with samples")
    return _Tdms(path, names, units, channels, timed)


class _Tdms(Table):
    def __init__(
        self, path: Path, names: Sequence[str], units: dict[int, str], channels: list[Any], timed: list[Any]
    ) -> None:
        super().__init__(path, names, units)
        self.channels = channels
        self.timed = timed

    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        names = [self.names[place] for place in places]
        asked = [self.channels[place] for place in places if place < len(self.channels)]
        found = []
        for k, (place, name) in enumerate(zip(places, names, strict=True)):
            if place < len(self.channels):
                values = np.asarray(self.channels[place][:rows])
            else:
                lead = next((channel for channel in asked if channel in self.timed), self.timed[0])
                step = float(lead.properties["wf_increment"])
                start = float(lead.properties.get("wf_start_offset", 0.0))
                values = start + step * np.arange(len(lead))[:rows]
            found.append(numeric(values, self.path, name))
            tell((k + 1) / len(places))
        even(self.path, found, names)
        return found
