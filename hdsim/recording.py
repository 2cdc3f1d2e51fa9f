"""Recordings: named arrays with units, the same for a simulated, a measured and a replayed run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    import pandas
    import xarray
    from matplotlib.figure import Figure

    from hdsim.scenario import Scenario
    from hdsim.studies import RunMetrics

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Column:
    """One quantity of a table: ``values`` of shape (n,) or (n, k), its SI unit and one line of what it is."""

    values: Array
    unit: str
    description: str = ""


@dataclass
class Table:
    """Columns over one time axis. ``time`` has shape (n,), in s, strictly increasing."""

    time: Array
    columns: dict[str, Column] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        """Values of a column."""
        try:
            return self.columns[name].values
        except KeyError:
            raise InputError(f"no channel {name!r}; there are: {', '.join(self.columns)}") from None

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __len__(self) -> int:
        return len(self.time)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.columns)


@dataclass(frozen=True)
class Event:
    """Something that happened at ``time`` (s); ``level`` is ``info``, ``warning`` or ``error``."""

    time: float
    level: str
    source: str
    message: str


@dataclass(eq=False)  # one is itself alone, so that what was computed of it can be kept beside it
class Recording:
    """A run: tables by name (``state`` at full rate, ``teeth`` at its own), static arrays, events, metadata.

    ``recording["motor_angle"]``, or ``recording.motor_angle``, reads the state table. ``static`` holds what
    does not change in time (tooth angles, gaps). ``metadata`` maps names to text (scenario, versions, seed,
    solver, tolerances). ``sensitivities`` holds, by parameter, the derivatives that were asked for; a log
    does not keep them.
    """

    tables: dict[str, Table]
    static: dict[str, Column] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)
    sensitivities: dict[str, Table] = field(default_factory=dict)

    @property
    def state(self) -> Table:
        """The table at full rate.

        Raises:
            InputError: there is none, as the run stopped before its first sample.
        """
        if "state" not in self.tables:
            raise InputError("no sample is there: the run stopped before its first one")
        return self.tables["state"]

    @property
    def time(self) -> Array:
        """Time of the state table, in s."""
        return self.state.time

    @property
    def channels(self) -> Mapping[str, Column]:
        """Columns of the state table."""
        return self.state.columns

    def __getitem__(self, name: str) -> Array:
        """Values of a channel of the state table."""
        return self.state[name]

    def __contains__(self, name: object) -> bool:
        return name in self.state

    def __iter__(self) -> Iterator[str]:
        return iter(self.state.columns)

    if not TYPE_CHECKING:  # a typo in typed code is still found

        def __getattr__(self, name: str) -> Array:
            """Values of a channel of the state table, where nothing else has its name."""
            state = self.__dict__.get("tables", {}).get("state")
            if state is None or name not in state:
                raise AttributeError(f"a recording has no channel or attribute {name!r}")
            return state[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in self if name.isidentifier())]

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    def _repr_html_(self) -> str:
        from hdsim.notebook import recording_html

        return recording_html(self)

    def unit(self, name: str) -> str:
        """Unit of a channel of the state table."""
        self.state[name]
        return self.state.columns[name].unit

    def save(self, path: str | Path) -> Path:
        """Write the recording as an MCAP log; returns its path."""
        from hdsim.log import write_log

        return write_log(self, path)

    def to_pandas(self, table: str = "state") -> pandas.DataFrame:
        """A table as a data frame over time (s), for ``hdsim[notebook]``.

        Args:
            table: its name; of the teeth the columns are (channel, tooth).

        Returns:
            The frame; ``attrs`` holds ``units`` and ``descriptions`` by column, and the metadata.

        Raises:
            InputError: there is no such table, or pandas is not installed.
        """
        from hdsim.notebook import to_pandas

        return to_pandas(self, table)

    def to_xarray(self) -> xarray.Dataset:
        """All tables and static arrays as one dataset, for ``hdsim[notebook]``.

        Returns:
            Variables over ``time``; those of the teeth over ``teeth_time`` and ``tooth``. Each has ``units``
            and ``long_name``; the metadata are the dataset's attributes.

        Raises:
            InputError: xarray is not installed.
        """
        from hdsim.notebook import to_xarray

        return to_xarray(self)

    def metrics(self, scenario: Scenario | None = None) -> RunMetrics:
        """The run's numbers by name, such as ``settling_time``: value, unit, definition and its source.

        The same numbers as in ``hdsim run``, ``hdsim budget`` and ``hdsim study``; each is computed when it
        is first asked for.

        Args:
            scenario: what was run; what the recording carries when None.

        Raises:
            InputError: the recording carries no scenario and none is given.
        """
        from hdsim.studies import metrics_of

        return metrics_of(self, scenario)

    def plot(self, **options: Any) -> Figure:
        """Draw the one-page figure of the run."""
        from hdsim.plot import plot_recording

        return plot_recording(self, **options)
