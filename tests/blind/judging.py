"""Whether what a diagnosis says of a blind case is right, from stored lines: it can be asked again."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from contract import Case

Line = dict[str, Any]

#: Most names that a group of indistinguishable effects may have to count.
MOST_NAMES = 3
#: What can come of a case.
OUTCOMES = ("right", "wrong name", "unknown", "nothing", "error")
#: A held-out gap this much above what is possible can be closed.
CLOSABLE = 1.1


def groups(line: Line) -> list[list[str]]:
    """Names that were given, a group of indistinguishable ones each, in the order of the verdict."""
    effects = line["verdict"]["effects"] if line.get("verdict") else []
    return [sorted({e["name"], *e["indistinguishable_from"]}) for e in effects]


def said(line: Line) -> str:
    """A verdict in a few words."""
    if not line["verdict"]:
        return str(line["error"])
    return " + ".join([line["verdict"]["verdict"], *("/".join(group) for group in groups(line))])


def outcome(line: Line) -> str:
    """One of ``OUTCOMES``; ``wrong name`` of a case in which nothing is hidden is a false alarm.

    ``nothing`` is any verdict without a name that isn't ``unknown``: a number that is said to be off, too.
    """
    if not line["verdict"]:
        return "error"
    if "without" in line:
        return _put_in(line)
    verdict, names, truth = line["verdict"]["verdict"], groups(line), [set(t) for t in line["truth"]]
    kind = line["kind"]
    if kind == "null":
        right = verdict in ("nothing", "parameter")
    elif kind == "parameter":
        right = verdict == "parameter"
    elif kind == "outside":
        right = verdict == "unknown"
    elif kind == "pair":
        right = all(any(_holds(group, wanted) for group in names) for wanted in truth)
    else:
        right = bool(names) and _holds(names[0], truth[0])
    if right:
        return "right"
    if names:
        return "wrong name"
    return "unknown" if verdict == "unknown" else "nothing"


def _put_in(line: Line) -> str:
    """Outcome for a recording of a real machine into which something was put, against the one without it.

    Of the names only those count that the recording as it is does not get, and that its joint is not known
    to deserve.
    """
    truth, at = set().union(*line["truth"]), line["setup"].get("at")
    new = [groups(line)[k] for k in _new(line)]
    if truth and _named(line, truth, at) and not _named(line["without"], truth, at):
        return "right"
    if any(not set(group) & truth for group in new):
        return "wrong name"
    same = line["verdict"]["verdict"] == (line["without"]["verdict"] or {}).get("verdict")
    if line["verdict"]["verdict"] == "unknown" and not same:
        return "unknown"
    return "nothing" if truth else "right"


def _new(line: Line) -> list[int]:
    """Which names neither the recording as it is gets nor its joint is known to deserve."""
    before = {name for group in groups(line["without"]) for name in group} | set(line["setup"].get("own", []))
    return [k for k, group in enumerate(groups(line)) if not set(group) & before]


def _speaks(line: Line) -> int | None:
    """Which name of a recording of a real machine its stated confidence is about.

    The first that is new, or what was put in; where none is, the first that its joint is known to deserve.
    Of any other nobody knows whether it is right.
    """
    truth, at, known = set().union(*line["truth"]), line["setup"].get("at"), set(line["setup"].get("own", []))
    new = {*_new(line), *(k for k in range(len(groups(line))) if _is(line, k, truth, at))}
    own = (k for k, group in enumerate(groups(line)) if set(group) & known)
    return min(new) if new else next(own, None)


def _named(line: Line, truth: set[str], at: dict[str, Any] | None) -> bool:
    """Whether a name is given, with a component of the right order, within a factor of two of its size."""
    return any(_is(line, k, truth, at) for k in range(len(groups(line))))


def _is(line: Line, k: int, truth: set[str], at: dict[str, Any] | None) -> bool:
    """Whether an effect of a verdict is the true one.

    Another name that the data cannot tell from it counts with a component of that order only, in whatever
    unit: two that can stand in for one another at some order are not the same thing at another.
    """
    effect = line["verdict"]["effects"][k]
    if not _holds(groups(line)[k], truth):
        return False
    components = _components(effect)
    if at is None or (effect["name"] in truth and not components):
        return True
    for one in components:
        size = one.get(at["field"]) if effect["name"] in truth else None
        if size is not None and at["field"] == "cogging_nm":
            # What was put in is what the current reads; what is fitted is the torque behind its gain.
            size *= _gain_of(line)
        same = abs(one["order"] / at["order"] - 1.0) < 0.01 and one.get("per") != "output_turn"
        if same and (size is None or 0.5 < abs(size / at["size"]) < 2.0):
            return True
    return False


def _gain_of(line: Line) -> float:
    """Reading over torque of the motor's channel, as fitted."""
    found = (line["verdict"] or {}).get("parameters", {}).get("motor_torque_gain")
    return float(found["value"]) if found else 1.0


def _components(effect: dict[str, Any]) -> list[dict[str, Any]]:
    """All of an effect that has an order, with its fields; what was fitted, where a line has no more."""
    if effect.get("settings"):
        return _with_order(effect["settings"])
    found: dict[str, dict[str, Any]] = {}
    for path, number in effect["parameters"].items():
        one, _, field = path.rpartition(".")
        if one:
            found.setdefault(one, {})[field] = number["value"]
    return [one for one in found.values() if "order" in one]


def _with_order(settings: Any, of: str = "") -> list[dict[str, Any]]:
    """The sections of an effect's settings that have an order, however deep.

    An eccentric encoder, the section ``of`` a channel, errs once in a turn of its shaft.
    """
    if isinstance(settings, dict):
        own = [settings] if "order" in settings else []
        if "eccentricity_arcmin" in settings:
            turn = "output_turn" if of == "output_angle" else "wave_generator_turn"
            own.append({"order": 1.0, "per": turn})
        return own + [one for name, part in settings.items() for one in _with_order(part, name)]
    return [one for part in settings for one in _with_order(part)] if isinstance(settings, list) else []


def _holds(group: list[str], wanted: set[str]) -> bool:
    return len(group) <= MOST_NAMES and bool(set(group) & wanted)


def false_name(line: Line) -> bool:
    """Whether the first name given is none of the truth's, in a group however large."""
    if "without" in line:
        return bool(line["truth"]) and outcome(line) == "wrong name"
    names = groups(line)
    truth = {name for wanted in line["truth"] for name in wanted}
    return bool(names) and not set(names[0]) & truth


def false_alarm(line: Line) -> bool:
    """Whether something is said to be missing; for cases in which nothing is."""
    if "without" in line:
        return outcome(line) != "right"
    return line["verdict"] is None or line["verdict"]["verdict"] in ("effect", "unknown")


def stated(line: Line) -> float | None:
    """Confidence that the verdict states: its own, else that of its first name; ``None`` without one.

    Of a recording of a real machine, which has names of its own, that of the name of ``_speaks``.
    """
    verdict = line["verdict"] or {}
    if "without" in line and verdict.get("effects"):
        which = _speaks(line)
        return None if which is None else float(verdict["effects"][which]["confidence"])
    if verdict.get("confidence") is not None:
        return float(verdict["confidence"])
    return float(verdict["effects"][0]["confidence"]) if verdict.get("effects") else None


def closed(
    case: Case,
    gap: dict[str, Any],
    readings: int = 1,
    without: dict[str, Any] | None = None,
    *,
    since: Literal["before", "refit"] = "refit",
    until: Literal["after", "with_curve"] = "after",
) -> float | None:
    """Share of the held-out gap that was closed, of what noise leaves to close.

    Of the channel whose gap over its best possible is largest. The best possible is what the held-out log
    differs from ideal sensors in the plant, or what the plant itself leaves when its motor is moved as the
    log tells (what rattles in its play is in no log), where that is more; where neither is known, the
    channel's noise, or, of a recording into which something was put, what its diagnosis leaves of the
    recording as it is: the machine's own.
    ``None`` where less than a tenth of the gap is more than that.

    Args:
        case: the case.
        gap: the verdict's, by channel.
        readings: of the means that were compared.
        without: the verdict's on the recording as it is.
        since: of the gap after the re-fit (what a bent base cannot explain), or of the model's as given.
        until: the gap with the named effects, or with the curve of what they leave, too, where that was kept.
    """
    best: tuple[float, float] | None = None
    for channel, own in gap.items():
        floor = _floor(case, channel, readings) or own["noise"]
        floor = max(floor, _followed(case, channel))
        if without and channel in without:
            floor = max(floor, without[channel]["after"])
        if not floor or own[since] < CLOSABLE * floor:
            continue
        excess = own[since] / floor
        if best is None or excess > best[0]:
            reached = own.get(until)
            reached = own["after"] if reached is None else reached
            best = (excess, (own[since] - reached) / (own[since] - floor))
    return None if best is None else round(best[1], 4)


def _floor(case: Case, channel: str, readings: int) -> float | None:
    def means(values: Any) -> Any:
        return values[: len(values) // readings * readings].reshape(-1, readings).mean(axis=1)

    squares = [
        float(np.nanvar(means(record.channels[channel] - record.ideal[channel])))
        for record in (case.holdout or case.records)
        if channel in record.ideal and channel in record.channels
    ]
    return float(np.sqrt(np.mean(squares))) if squares else None


def _followed(case: Case, channel: str) -> float:
    """What the plant leaves of a channel of the held-out log, 0 where nobody has asked."""
    left = [record.followed.get(channel, 0.0) for record in (case.holdout or case.records)]
    return float(np.sqrt(np.mean(np.square(left))))


def covered(case: Case, verdict: dict[str, Any]) -> list[list[Any]]:
    """For every true number that was fitted: its path, truth, value, interval's ends, whether it holds.

    Args:
        case: the case.
        verdict: as JSON.
    """
    known = set().union(*case.truth)
    named = [e["parameters"] for e in verdict["effects"] if e["name"] in known]
    rows: list[list[Any]] = []
    for path, truth in case.numbers.items():
        for given in (verdict["parameters"], *named):
            number = given.get(_same_order(path, case.numbers, given))
            if number is not None and number["interval"] is not None:
                rows.append(_row(path, truth, number["value"], *number["interval"]))
                break
    return rows


def _row(path: str, truth: float, value: float, low: float, high: float) -> list[Any]:
    if path.endswith("_deg"):
        # An angle is one of many; a tooth meets the wave generator twice a turn.
        turn = 180.0 if path == "position_deg" else 360.0
        truth = value + (truth - value + turn / 2) % turn - turn / 2
    return [path, truth, value, low, high, bool(low <= truth <= high)]


def _same_order(path: str, expected: dict[str, float], given: dict[str, Any]) -> str:
    """Path of the fitted harmonic whose order is that of the expected one."""
    section, _, last = path.rpartition(".")
    order = expected.get(f"{section}.order")
    if order is None:
        return path
    for other in given:
        if other.endswith(".order") and abs(given[other]["value"] - order) < 0.01 * order:
            return f"{other.removesuffix('.order')}.{last}"
    return path


def borne_out(line: Line) -> bool:
    """Whether what the stated confidence is about is true: the first name, or the verdict without one."""
    names = groups(line)
    if not names:
        return outcome(line) == "right"
    if "without" in line:
        which = _speaks(line)
        truth, at = set().union(*line["truth"]), line["setup"].get("at")
        return which is not None and (which not in _new(line) or _is(line, which, truth, at))
    return any(_holds(names[0], set(wanted)) for wanted in line["truth"])
