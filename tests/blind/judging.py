"""What a diagnosis says of a blind case, and whether that is right.

Only the log and the base are handed over.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from cases import Case, Trial, case_of
from drives import base_yaml
from hidden import KNOWN
from sensing import Log, measure, numbers

import hdsim
from hdsim.diagnose.verdict import Verdict
from hdsim.diagnose.workflow import diagnose
from hdsim.errors import InputError
from hdsim.estimate.records import Record, record_from
from hdsim.scenario import Scenario

#: Most names that a group of indistinguishable effects may have to count.
MOST_NAMES = 3
MAPPING = "time: {column: time, unit: s, quantised: true}\nchannels:\n"


def base_of(case: Case) -> Scenario:
    """The base model of a case, from its YAML text."""
    setup = case.setup
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "base.yaml"
        text = base_yaml(setup.drive, gravity=setup.gravity, locked=setup.locked, lacks=setup.lacks)
        path.write_text(text, encoding="utf-8")
        return hdsim.load_scenario(path)


def record_of(case: Case, log: Log) -> Record:
    """The log as a record; one with repeated stamps goes through the import, as a user's would."""
    if case.setup.dirt != "coarse clock":
        return Record("blind", log.time, dict(log.channels))
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "log.csv"
        rows = np.column_stack([log.time, *log.channels.values()])
        np.savetxt(
            table, rows, delimiter=",", header=",".join(["time", *log.channels]), comments="", fmt="%.17g"
        )
        mapping = Path(folder) / "mapping.yaml"
        lines = []
        for name in log.channels:
            side = name.partition("_")[0]
            unit = {"angle": "rad", "torque": "N m"}[name.rpartition("_")[2]]
            lines.append(f"  {name}: {{column: {name}, unit: {unit}, side: {side}}}\n")
        mapping.write_text(MAPPING + "".join(lines), encoding="utf-8")
        return record_from(hdsim.import_recording(table, mapping))


def attempt(trial: Trial) -> dict[str, Any]:
    """Make a case, diagnose it, and judge: everything that the report needs, as JSON."""
    started = time.perf_counter()
    case = case_of(trial)
    log = measure(case.setup, numbers(case.setup, case.changes))
    found: dict[str, Any] = {
        "key": trial.key, "group": trial.group, "row": trial.row, "seed": trial.seed,
        "setup": case.setup.text, "changes": case.changes, "reached": case.reached,
        "strength": [[round(s.plain, 3), round(s.beyond_base, 3), s.channel] for s in case.strengths],
        "made_s": round(time.perf_counter() - started, 1),
    }  # fmt: skip
    started = time.perf_counter()
    try:
        diagnosis = diagnose([record_of(case, log)], base_of(case))
        verdict, last = diagnosis.verdict, diagnosis.stages[-1].location
    except (InputError, ArithmeticError, ValueError, IndexError, KeyError) as error:
        # A diagnosis that stops is a wrong answer and is listed as one.
        words = f"{type(error).__name__}: {error}".splitlines()[0][:300]
        found |= {
            "said": type(error).__name__,
            "verdict": "error",
            "names": [],
            "right": False,
            "error": words,
        }
        return found | {"seconds": round(time.perf_counter() - started, 1)}
    names = [sorted({e.name, *e.indistinguishable_from}) for e in verdict.effects]
    found |= {
        "verdict": verdict.verdict, "names": names, "first": [e.name for e in verdict.effects],
        "said": " + ".join([verdict.verdict, *("/".join(group) for group in names)]),
        "suspects": verdict.suspects, "moved": verdict.moved,
        "problems": sorted({p.kind for p in verdict.data_problems}),
        "right": judge(trial, verdict.verdict, names),
        "closed": closed(verdict, log),
        "covered": covered(case, verdict),
        "explained": round(diagnosis.explained, 4),
        "left": [round(last.structured, 4), round(last.chance, 4)],
        "gap": {c: [g.before, g.refit, g.after, g.noise] for c, g in verdict.gap.items()},
        "seconds": round(time.perf_counter() - started, 1),
    }  # fmt: skip
    return found


def judge(trial: Trial, verdict: str, names: list[list[str]]) -> bool:
    """Whether the answer is right; a group counts when it holds the truth and has at most three names."""
    if trial.group == "outside":
        return verdict == "unknown"
    if trial.parameters:
        return verdict == "parameter"
    if not trial.effects:
        return verdict in ("nothing", "parameter")
    if trial.group == "faint":
        # Silence is allowed, a wrong name is not.
        return not names or _holds(names[0], trial.accepted[0])
    if not names:
        return False
    if trial.group == "pair":
        return all(any(_holds(group, wanted) for group in names) for wanted in trial.accepted)
    return _holds(names[0], trial.accepted[0])


def _holds(group: list[str], wanted: frozenset[str]) -> bool:
    return len(group) <= MOST_NAMES and bool(set(group) & wanted)


def closed(verdict: Verdict, log: Log) -> float | None:
    """Share of the held-out gap after the re-fit that was closed, of what noise leaves to close.

    Of the channel whose gap over its best possible is largest. The best possible is what the log differs from
    ideal sensors in the plant. None where less than a tenth of the gap is more than noise.
    """
    best: tuple[float, float] | None = None
    for channel, gap in verdict.gap.items():
        rest = (log.channels[channel] - log.ideal[channel])[~log.spoilt]
        floor = float(np.nanstd(rest))
        if gap.refit < 1.1 * floor:
            continue
        excess = gap.refit / floor
        if best is None or excess > best[0]:
            best = (excess, (gap.refit - gap.after) / (gap.refit - floor))
    return None if best is None else round(best[1], 4)


def covered(case: Case, verdict: Verdict) -> list[list[Any]]:
    """For every number that should be recovered: its path, truth, value, interval, whether it holds."""
    if case.trial.parameters and case.setup.algebraic_sign:
        return []  # the formula of its friction isn't the model's
    if case.trial.parameters:
        given = verdict.parameters
    elif case.expected:
        name = case.trial.effects[0]
        own = name if name in KNOWN[name].accepted or not KNOWN[name].accepted else KNOWN[name].accepted[0]
        given = next((e.parameters for e in verdict.effects if e.name == own), {})
    else:
        return []
    rows: list[list[Any]] = []
    for path, truth in case.expected.items():
        number = given.get(_same_order(path, case.expected, given))
        if number is None or number.interval is None:
            continue
        low, high = number.interval
        value, inside = number.value, low <= truth <= high
        if path.endswith("_deg"):
            passes = 180.0 if path == "position_deg" else 360.0
            truth = value + (truth - value + passes / 2) % passes - passes / 2
            inside = low <= truth <= high
        rows.append([path, truth, value, low, high, bool(inside)])
    return rows


def _same_order(path: str, expected: dict[str, float], given: Any) -> str:
    """Path of the fitted harmonic whose order is that of the expected one."""
    section, _, last = path.rpartition(".")
    order = expected.get(f"{section}.order")
    if order is None:
        return path
    for other in given:
        if other.endswith(".order") and abs(given[other].value - order) < 0.01 * order:
            return f"{other.removesuffix('.order')}.{last}"
    return path
