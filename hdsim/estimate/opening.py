"""Measured records checked and made comparable: what every fit begins with."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

from hdsim.errors import InputError
from hdsim.estimate.bench import Bench
from hdsim.estimate.bridges import cut
from hdsim.estimate.check import check_records
from hdsim.estimate.data_problems import Check
from hdsim.estimate.offsets import Zeros
from hdsim.estimate.plan import LoadSource, Locked, given
from hdsim.estimate.predict import predictors
from hdsim.estimate.records import Record, record_from
from hdsim.estimate.reliability import knots_apart_s
from hdsim.estimate.short_cut import take_short_cut
from hdsim.estimate.state import state_of
from hdsim.estimate.thin import over, thinned
from hdsim.estimate.tolerance import as_exact_as_told

if TYPE_CHECKING:
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario


def checked(
    measured: Sequence[Recording | Record],
    scenario: Scenario,
    *,
    holdout: Sequence[Recording | Record] = (),
    load: LoadSource | None = None,
    force: bool = False,
) -> tuple[list[Record], list[Record], list[Check]]:
    """Training records, held-out records, and what is wrong with them; cut where gaps cannot be bridged.

    Raises:
        InputError: there is none, or one contradicts itself (see ``force``).
    """
    records, held = (
        [r if isinstance(r, Record) else record_from(r) for r in many] for many in (measured, holdout)
    )
    if not records:
        raise InputError("no measured record is given")
    checks = check_records([*records, *held], scenario.drive.ratio)
    _refuse(checks, force)
    source: dict[str, Any] = {"load": load, "locked": locked_side(scenario)}
    pieces = [
        cut(record, given(record, **source), check)
        for record, check in zip([*records, *held], checks, strict=True)
    ]
    _refuse(checks, force)
    training, holding = pieces[: len(records)], pieces[len(records) :]
    return [*chain(*training)], [*chain(*holding)], checks


def _refuse(checks: Sequence[Check], force: bool) -> None:
    errors = [problem for check in checks for problem in check.errors]
    if errors and not force:
        lines = "\n".join(f"{p.record}: {p.channel}: {p.kind}: {p.message}" for p in errors)
        raise InputError(f"{lines}\ncorrect the mapping or the data, or continue in spite of it (--force)")


def locked_side(scenario: Scenario) -> Locked:
    """The side that a scenario locks, if any."""
    if scenario.command.output.type == "locked":
        return "output"
    return "motor" if scenario.command.motor.type == "locked" else ""


def bench_for(
    records: Sequence[Record],
    held: Sequence[Record],
    scenario: Scenario,
    load: LoadSource | None = None,
    *,
    readings: int = 1,
    zeros: Zeros = "campaign",
) -> Bench:
    """The records with their predictors.

    Args:
        records: that fits may see.
        held: that only the proof sees; parts of the others when there are none.
        scenario: the model.
        load: where the load's torque comes from.
        readings: successive readings of which means are taken, of the record that is read fastest; of the
            others as many as come in the same time.
        zeros: whether a torque sensor has one zero in all records, one in each, or is trusted to have none.

    Raises:
        InputError: nothing can be predicted.
    """
    span = readings * min(record.period_s for record in [*records, *held])
    records, held = (
        [thinned(record, over(record, span) if readings > 1 else 1) for record in many]
        for many in (records, held)
    )
    ratio, locked = scenario.drive.ratio, locked_side(scenario)

    def opened(apart_s: float = 0.0) -> Bench:
        own, proving = (
            predictors(r, ratio, load=load, locked=locked, arm=scenario.load.arm, apart_s=apart_s)
            for r in (records, held)
        )
        return Bench(own, proving, zeros)

    bench, state = opened(), state_of(scenario)
    apart_s = knots_apart_s(bench, state)
    if apart_s > 0.0:
        bench = opened(apart_s)
    take_short_cut(bench, state)
    as_exact_as_told(bench, state)
    return bench
