"""MDF files (ASAM, versions 3 and 4), by asammdf; only the channels that are asked for are read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdsim.errors import InputError
from hdsim.log.readers.contract import Numbers, Table, Tell, needed, numeric, silent

if TYPE_CHECKING:
    from hdsim.log.mapping import Form

#: The column of the recorder's time, in s.
TIME = "time"


def open_table(path: Path, form: Form | None = None) -> Table:
    """Open an MDF file; a column is ``channel``, or ``group/channel`` (from 0) where two groups have it.

    ``time`` is the master of the first channel that is asked for; channels of other rates are interpolated
    to it.
    """
    asammdf = needed("asammdf", "asammdf", "mdf", "MDF")
    try:
        file = asammdf.MDF(path)
    except Exception as error:  # asammdf says of damaged files whatever went wrong first
        raise InputError(f"{path}: cannot be read as MDF: {error}") from None
    places = [
        (group, index)
        for group, content in enumerate(file.groups)
        for index in range(len(content.channels))
        if index != file.masters_db.get(group)
    ]
    plain = [file.groups[group].channels[index].name for group, index in places]
    twice = Counter(plain)
    names = [n if twice[n] == 1 else f"{g}/{n}" for n, (g, _) in zip(plain, places, strict=True)]
    units = {k: unit for k, (g, i) in enumerate(places) if (unit := file.get_channel_unit(group=g, index=i))}
    if not names:
        raise InputError(f"{path}: it has no channel")
    if TIME not in names:
        units[len(names)] = "s"
        names.append(TIME)
    return _Mdf(path, names, units, file, places)


class _Mdf(Table):
    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        units: dict[int, str],
        file: Any,
        places: list[tuple[int, int]],
    ) -> None:
        super().__init__(path, names, units)
        self.file = file
        self.places = places

    def read(self, places: Sequence[int], rows: int | None = None, tell: Tell = silent) -> list[Numbers]:
        found: dict[int, Numbers] = {}
        lead: Numbers | None = None
        asked = [place for place in dict.fromkeys(places) if place < len(self.places)]
        for k, place in enumerate(asked or [0]):
            group, index = self.places[place]
            try:
                signal = self.file.get(group=group, index=index, record_count=rows)
            except Exception as error:
                raise InputError(f"{self.path}: {self.names[place]}: cannot be read: {error}") from None
            values = numeric(signal.samples, self.path, self.names[place])
            time = np.asarray(signal.timestamps, np.float64)
            if lead is None:
                lead = time
            if len(time) != len(lead) or not np.array_equal(time, lead):
                values = np.interp(lead, time, values, left=np.nan, right=np.nan)
            found[place] = values
            tell((k + 1) / max(len(asked), 1))
        assert lead is not None
        return [found.get(place, lead) for place in places]
