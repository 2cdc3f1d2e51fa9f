"""What a log gathers of its tables for viewers while they are written: facts, states, orders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from hdsim.log import naming, states
from hdsim.log.facts import RECORD, Facts, FactsCollector
from hdsim.log.orders import ORDERS, OVER_ANGLE, OrderCollector

if TYPE_CHECKING:
    from hdsim.log.writer import LogWriter

_STATES_OF_VIEW = 0.03
"""Samples that are looked at for changes of state, as a share of the view's."""


class Digest:
    """Gathers, and writes what it found to the log.

    Args:
        log: the log that is written.
        metadata: its run's.
        view_rate_hz: samples a second in the view.
    """

    def __init__(self, log: LogWriter, metadata: Mapping[str, str], view_rate_hz: float) -> None:
        self._log = log
        self._facts = FactsCollector(metadata)
        self._orders = OrderCollector()
        self._states = states.StateFinder(Facts.of_metadata(metadata), _STATES_OF_VIEW * view_rate_hz)

    def feed(self, table: str, time: naming.Array, columns: Mapping[str, naming.Array]) -> None:
        """Take the next rows of a table."""
        self._facts.feed(table, time, columns)
        self._orders.feed(table, time, columns)
        if table == "state":
            self._write_states(*self._states.feed(time, columns))

    def _write_states(self, times: naming.Array, messages: list[bytes]) -> None:
        if messages:
            self._log.write_messages(
                states.TOPIC,
                states.MESSAGE_TYPE,
                lambda: states.schema(self._states.fields),
                naming.to_ns(times).tolist(),
                messages,
                fields=self._states.fields,
            )

    def finish(self) -> Facts:
        """Write what is known at the end only; returns the facts."""
        self._write_states(*self._states.finish())
        spectrum = self._orders.spectrum()
        if spectrum is not None:
            degrees, arcsec = ("output_angle_deg", "deg"), ("transmission_error_arcsec", "arcsec")
            self._log.write_arrays(OVER_ANGLE, {degrees: spectrum.output_angle, arcsec: spectrum.error})
            self._log.write_arrays(ORDERS, {("order", "1"): spectrum.order, arcsec: spectrum.amplitude})
        facts = self._facts.facts()
        self._log.write_metadata(RECORD, facts.record)
        return facts
