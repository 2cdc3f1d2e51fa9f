"""Angles and velocities of the draft, out of the readings that fit."""

from __future__ import annotations

import math

import numpy as np

from hdsim.log.guess.findings import Answer, Candidate, Channel, Draft, Ground
from hdsim.log.guess.motion import Motion, solve
from hdsim.log.guess.readings import Reading, physical_side, readings, stated_unit
from hdsim.log.guess.relations import Array, moves, turn_of, unwound

#: What costs no more than this over the best is as usual: the question stays open. Beyond the second it is
#: out.
USUAL = 0.8
POSSIBLE = 5.0
#: For the side of a column whose name does not say it: so much beyond the usual size of the other side.
USUAL_SIDE = 1.2
_INTEGER = 0.004


def map_motion(
    measured: list[Candidate],
    travels: dict[str, float],
    time: Array,
    times: dict[str, tuple[float, float]],
    ratio: float | None,
    torque: Array | None,
    many: bool,
    draft: Draft,
) -> float | None:
    """Add time's unit, angles, velocities and the ratio to the draft.

    Returns:
        The ratio, where it is known.
    """
    columns = []
    for column in measured:
        if column.quantity not in ("angle", "velocity"):
            continue
        if moves(column.values):
            columns.append(column)
        else:
            draft.unused[column.label] = "all its numbers are the same"
    turns = [turn_of(c.values) if c.quantity == "angle" else None for c in columns]
    values = [c.values if t is None else unwound(c.values, t) for c, t in zip(columns, turns, strict=True)]
    options = [
        readings(c, c.values, max(travels.get(c.meaning.stem, 0.0), _size(v, c)), many)
        for c, v in zip(columns, values, strict=True)
    ]
    motion = solve(columns, values, options, time, times, ratio, torque)
    _unit_of_time(motion, times, draft)
    if motion is None:
        if ratio is not None:
            draft.ratio = Answer(ratio, Ground.SAID)
        return ratio
    number = _ratio(motion, ratio, columns, draft)
    for k in sorted(range(len(columns)), key=lambda k: -len(np.unique(columns[k].values))):
        _add(k, columns, motion, turns[k], draft)
    return number


def _size(values: Array, column: Candidate) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite) if column.quantity == "angle" else np.quantile(np.abs(finite), 0.99))


def _unit_of_time(motion: Motion | None, times: dict[str, tuple[float, float]], draft: Draft) -> None:
    if "column" not in draft.time or "unit" in draft.time:
        return
    best = motion.time if motion is not None else min(times, key=lambda unit: times[unit][1])
    alone: dict[object, float] = {unit: cost for unit, (_, cost) in times.items()}
    costs = motion.costs[("time", 0)] if motion is not None else alone
    draft.time["unit"] = _judged(
        best, costs, "the only one that fits spacing and slopes", "from the spacing of the samples"
    )
    if draft.time["unit"].ground == Ground.OPEN:
        draft.ask(f"the unit of the time, {draft.time['unit'].why}", "time.unit", str(best))


def _judged(
    best: object, costs: dict[object, float], shown: str, assumed: str, usual: float = USUAL
) -> Answer:
    """An answer whose ground is how unusual the other values are."""
    rivals = sorted(
        (cost, f"{value:.10g}" if isinstance(value, float) else str(value))
        for value, cost in costs.items()
        if value != best
    )
    if not rivals or rivals[0][0] > POSSIBLE:
        return Answer(best, Ground.SHOWN, shown)
    possible = ", ".join(value for cost, value in rivals if cost <= POSSIBLE)
    if rivals[0][0] > usual:
        return Answer(best, Ground.ASSUMED, f"{assumed}; the numbers would allow {possible}")
    *others, last = [str(best), *(value for cost, value in rivals if cost <= POSSIBLE)]
    return Answer(None, Ground.OPEN, f"{', '.join(others)} or {last}")


def _ratio(motion: Motion, said: float | None, columns: list[Candidate], draft: Draft) -> float | None:
    if said is not None:
        sign = math.copysign(1.0, motion.ratio) if motion.ratio else math.copysign(1.0, said)
        if motion.ratio and sign != math.copysign(1.0, said):
            draft.ask(
                f"the sign of the ratio: you gave {said:g}, the angles turn the other way",
                "ratio",
                f"{-said:g}",
            )
        draft.ratio = Answer(said, Ground.SAID)
        return said
    if motion.ratio is None:
        return None
    whole = round(motion.ratio)
    near = abs(motion.ratio - whole) < _INTEGER * abs(whole)
    value = float(whole) if near else float(f"{motion.ratio:.6g}")
    by_angle = {column.label for column in columns if column.quantity == "angle"}
    across = [
        columns[k].label
        for k, reading in motion.best.items()
        if reading is not None and reading.side != motion.best[motion.reference].side  # type: ignore[union-attr]
    ]
    across = [label for label in across if label in by_angle] or across
    why = f"slope {motion.ratio:.5g} between {columns[motion.reference].label} and {', '.join(across)}"
    costs = {round(float(v), 3): c for v, c in motion.costs[("ratio", 0)].items() if v is not None}  # type: ignore[arg-type]
    rivals = [v for v, c in costs.items() if c <= USUAL and abs(v - motion.ratio) > 0.05 * abs(v)]
    possible = [v for v, c in costs.items() if c <= POSSIBLE and abs(v - motion.ratio) > 0.05 * abs(v)]
    if rivals:
        draft.ratio = Answer(None, Ground.OPEN, f"{value:g} or {', '.join(f'{v:g}' for v in rivals)}")
        draft.ask(f"the ratio, {value:g} or {', '.join(f'{v:g}' for v in rivals)}", "ratio", f"{value:g}")
        return None
    if possible:
        why += f"; the numbers would allow {', '.join(f'{v:g}' for v in possible[:4])}"
    draft.ratio = Answer(value, Ground.ASSUMED if possible or not near else Ground.SHOWN, why)
    return value


def _add(k: int, columns: list[Candidate], motion: Motion, turn: float | None, draft: Draft) -> None:
    column, reference = columns[k], columns[motion.reference]
    best = motion.best.get(k)
    if best is None:
        draft.unused[column.label] = f"as no unit does it go with {reference.label}"
        draft.ask(
            f"{column.label} contradicts {reference.label}: no unit makes them one motion",
            f"{column.label}.channel",
            "none",
        )
        return
    costs = motion.costs[("reading", k)]
    fitted = k in motion.slopes or (k == motion.reference and len(motion.slopes) > 0)
    beside = ", ".join(columns[j].label for j in motion.slopes) if k == motion.reference else reference.label
    side, why, ground = _side(column, best, costs, motion)
    name = f"{physical_side(column) or side}_{column.quantity}"
    taken = name in draft.channels
    keys: dict[str, Answer] = {}
    if not taken or best.contradicts:  # a contradiction is told even of a column that is not needed
        keys["unit"] = _unit(column, best, costs, beside, fitted, draft)
    if best.unit == "count":
        keys["counts_per_turn"] = _counts(column, best, costs)
    if taken:
        draft.unused[column.label] = f"{draft.channels[name].source.label} is {name} already, in finer steps"
        return
    if best.side != name.split("_")[0]:
        keys["side"] = Answer(best.side, ground, why)
    if motion.signs.get(k, 1) < 0:
        keys["sign"] = Answer(-1, Ground.SHOWN, f"it runs against {reference.label}")
    if turn is not None:
        keys["unwrap"] = Answer(True, Ground.SHOWN, f"it jumps by {turn:.6g}")
    channel = Channel(column, keys, why, ground)
    draft.channels[name] = channel
    if ground == Ground.OPEN:
        draft.ask(
            f"the channel of {column.label}: output_{column.quantity} or motor_{column.quantity}",
            f"{column.label}.channel",
            f"output_{column.quantity}",
        )
    for key in ("unit", "counts_per_turn"):
        answer = keys.get(key)
        if answer is not None and answer.ground == Ground.OPEN and not best.contradicts:
            usual = best.unit if key == "unit" else f"{best.counts:.10g}"
            draft.ask(f"the {key} of {column.label}: {answer.why}", f"{column.label}.{key}", usual)


def _unit(
    column: Candidate, best: Reading, costs: dict[object, float], beside: str, fitted: bool, draft: Draft
) -> Answer:
    stated = stated_unit(column)
    if best.contradicts:
        why = f"the file says {stated}, the numbers fit {best.unit} (beside {beside})"
        draft.ask(f"the unit of {column.label}: {why}", f"{column.label}.unit", best.unit)
        return Answer(None, Ground.OPEN, why)
    if "unit" in column.said:
        return Answer(best.unit, Ground.SAID)
    if stated:
        agrees = "; the slopes agree" if fitted else ""
        return Answer(
            best.unit, Ground.STATED, f"the file says {column.meaning.unit.strip() or stated!r}{agrees}"
        )
    by_unit: dict[object, float] = {}
    for reading, cost in costs.items():
        if isinstance(reading, Reading):
            by_unit[reading.unit] = min(cost, by_unit.get(reading.unit, math.inf))
    return _judged(best.unit, by_unit, "no other unit fits the numbers", "the usual one for their size")


def _counts(column: Candidate, best: Reading, costs: dict[object, float]) -> Answer:
    if "counts_per_turn" in column.said:
        return Answer(best.counts, Ground.SAID)
    of_counts: dict[object, float] = {}
    for reading, cost in costs.items():
        if isinstance(reading, Reading) and reading.counts is not None:
            of_counts[reading.counts] = min(cost, of_counts.get(reading.counts, math.inf))
    answer = _judged(best.counts, of_counts, "from its slope", "the usual one that fits")
    power = math.log2(best.counts or 1.0)
    return Answer(
        answer.value, answer.ground, f"2^{power:.0f}: {answer.why}" if power % 1 == 0 else answer.why
    )


def _side(
    column: Candidate, best: Reading, costs: dict[object, float], motion: Motion
) -> tuple[str, str, Ground]:
    """Side to which the numbers refer, why, and how sure that is."""
    if "channel" in column.said or "side" in column.said:
        return best.side, "you say so", Ground.SAID
    own = physical_side(column)
    if own == best.side:
        return best.side, "by its name", Ground.STATED
    of_side: dict[object, float] = {}
    for reading, cost in costs.items():
        if isinstance(reading, Reading):
            of_side[reading.side] = min(cost, of_side.get(reading.side, math.inf))
    why = f"the numbers refer to the {best.side}"
    answer = _judged(best.side, of_side, why, f"taken for the {best.side}'s", USUAL_SIDE)
    if answer.ground == Ground.SHOWN and motion.ratio is None:
        # Only a slope over the other side would show it.
        return best.side, f"taken for the {best.side}'s, by its size and name", Ground.ASSUMED
    return best.side, answer.why, answer.ground
