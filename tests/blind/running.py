"""Draw blind cases, hand log and base to the diagnosis, and store what it says: one JSON line a case."""

from __future__ import annotations

import concurrent.futures
import gzip
import importlib
import json
import multiprocessing
import os
import pickle
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from contract import AbsentError, Case, Measured
from judging import Line, closed, covered

import hdsim
from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.records import Record
from hdsim.scenario import Scenario

FAMILIES = ("numpy", "mujoco", "toothed", "teeth", "real")
#: Cases of the page, packed.
KEPT = Path(__file__).parent / "results.jsonl.gz"


@dataclass(frozen=True)
class Task:
    """A case before it is drawn."""

    family: str
    number: int
    seed: int
    most_samples: int = field(default=10**9, compare=False)
    cases: Path | None = field(default=None, compare=False)  # where drawn cases are kept


def task_of(key: str) -> Task:
    """The task of a key ``family/kind/truth/number/seed``."""
    family, *_, number, seed = key.split("/")
    return Task(family, int(number), int(seed))


def family(name: str) -> ModuleType:
    """The module of a family.

    Raises:
        AbsentError: what it needs is not here.
    """
    try:
        return importlib.import_module(f"family_{name}")
    except ModuleNotFoundError as error:
        raise AbsentError(f"family {name}: {error}") from None


def drawn(task: Task) -> Case:
    """The case of a task: as it is kept, or drawn now, and kept where the task has a folder for that.

    Raises:
        AbsentError: what the family needs is not here.
    """
    module = family(task.family)
    if task.cases is None:
        case: Case = module.draw(task.number, task.seed)
        return case
    kept = task.cases / f"{task.family}-{task.number}-{task.seed}.pickle"
    if kept.exists():
        case = pickle.loads(kept.read_bytes())
        return case
    case = module.draw(task.number, task.seed)
    task.cases.mkdir(parents=True, exist_ok=True)
    part = kept.with_suffix(f".{os.getpid()}")
    part.write_bytes(pickle.dumps(case))
    part.replace(kept)
    return case


def keep(task: Task) -> Line:
    """Draw a case to be kept, and say so in a line."""
    started = time.process_time()
    line: Line = {"key": f"{task.family}/-/-/{task.number}/{task.seed}", "error": None}
    try:
        line["key"] = drawn(task).key
    except AbsentError:
        raise
    except Exception as error:
        line["error"] = f"not drawn: {_words(error)}"
    return line | {"made_cpu_s": round(time.process_time() - started, 2)}


def base_of(case: Case) -> Scenario:
    """The base model, from its YAML text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "base.yaml"
        path.write_text(case.base, encoding="utf-8")
        return hdsim.load_scenario(path)


def record_of(measured: Measured) -> Record:
    """A record as the diagnosis takes it; nothing that an ideal sensor would read goes along."""
    return Record(measured.name, measured.time.copy(), {c: v.copy() for c, v in measured.channels.items()})


def attempt(task: Task) -> Line:
    """Draw a case and diagnose it: everything that the page needs, as JSON.

    Raises:
        AbsentError: what the family needs is not here.
    """
    started = time.process_time()
    line: Line = {"key": "", "family": task.family, "number": task.number, "seed": task.seed, "kind": "",
                  "truth": [], "strength": [], "setup": {}, "verdict": None, "error": None}  # fmt: skip
    try:
        case = drawn(task)
    except AbsentError:
        raise
    except Exception as error:
        line["key"] = f"{task.family}/not drawn/-/{task.number}/{task.seed}"
        return line | {"error": f"not drawn: {_words(error)}"}
    line |= {
        "key": case.key, "kind": case.kind, "truth": [sorted(t) for t in case.truth],
        "strength": [float(s) for s in case.strength], "setup": case.setup,
        "made_cpu_s": round(time.process_time() - started, 2),
    }  # fmt: skip
    samples = sum(len(record.time) for record in (*case.records, *case.holdout))
    if samples > task.most_samples:
        raise AbsentError(f"{case.key}: {samples} samples, more than {task.most_samples}")
    if case.without is not None:
        line["without"] = _without(case.without)
    line |= _diagnosed(case)
    if case.without is not None and line.get("verdict") and line["without"]["verdict"]:
        verdict, plain = line["verdict"], line["without"]["verdict"]
        line |= _closed(case, verdict, plain["gap"])
    return line


#: Diagnoses of recordings as they are, by what is told apart in their keys.
_PLAIN: dict[str, Line] = {}


def _without(case: Case) -> Line:
    """What is said of the recording as it is; once in a process."""
    name = case.key.split("/")[2]
    if name not in _PLAIN:
        found = _diagnosed(case)
        _PLAIN[name] = {"verdict": found.get("verdict"), "error": found.get("error"), "cpu_s": found["cpu_s"]}
    return _PLAIN[name]


def _diagnosed(case: Case) -> Line:
    started, began = time.process_time(), time.perf_counter()
    found: Line = {}
    try:
        diagnosis = diagnose(
            [record_of(r) for r in case.records],
            base_of(case),
            holdout=[record_of(r) for r in case.holdout],
            load=case.load,
        )
    except Exception as error:
        # A diagnosis that stops is a wrong answer, whatever stops it.
        found["error"] = _words(error)
    # All threads of this process count.
    found |= {"cpu_s": round(time.process_time() - started, 2), "s": round(time.perf_counter() - began, 2)}
    if "error" in found:
        return found
    verdict = diagnosis.verdict.model_dump(mode="json")
    if verdict.get("curve"):
        verdict["curve"] = {k: v for k, v in verdict["curve"].items() if not isinstance(v, (list, dict))}
    found |= {
        "verdict": verdict,
        "seconds": verdict["seconds"],
        "numbers": covered(case, verdict),
        "expected": case.numbers,
        **_closed(case, verdict),
    }
    evidence = getattr(diagnosis, "evidence", None)
    if evidence is not None:
        found["evidence"] = evidence.model_dump(mode="json")
    return found


def _closed(case: Case, verdict: Line, plain: Line | None = None) -> Line:
    gap, readings = verdict["gap"], verdict["readings"]
    return {
        "closed": closed(case, gap, readings, plain),
        "closed_since_before": closed(case, gap, readings, plain, since="before"),
        "closed_with_curve": closed(case, gap, readings, plain, until="with_curve"),
    }


def _words(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0][:300]


def lines_of(paths: Sequence[Path]) -> list[Line]:
    """Stored lines, the last of each case; one that was cut off is left out."""
    found: dict[Task, Line] = {}
    for path in paths:
        for text in _text(path).splitlines() if path.exists() else ():
            try:
                line = json.loads(text)
            except json.JSONDecodeError:
                continue
            found[Task(line["family"], line["number"], line["seed"])] = line
    return list(found.values())


def _text(path: Path) -> str:
    if path.suffix == ".gz":
        return gzip.decompress(path.read_bytes()).decode()
    return path.read_text(encoding="utf-8")


def store(lines: Sequence[Line], path: Path) -> None:
    """Keep lines where everybody can judge them again: packed, sorted, six digits of every number."""
    ordered = sorted(lines, key=lambda line: (line["family"], line["seed"], line["number"]))
    text = "\n".join(stored(_rounded(line)) for line in ordered)
    path.write_bytes(gzip.compress(text.encode(), mtime=0))


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    return [_rounded(part) for part in value] if isinstance(value, list) else value


def run(
    todo: Sequence[Task], jobs: int, work: Callable[[Task], Line] = attempt
) -> Iterator[Line | AbsentError]:
    """Lines of ``work`` as they come."""
    if jobs == 1:
        for task in todo:
            try:
                yield work(task)
            except AbsentError as missing:
                yield missing
        return
    # One thread a process: the processes are what runs side by side.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(jobs, mp_context=context) as pool:
        for future in concurrent.futures.as_completed([pool.submit(work, task) for task in todo]):
            try:
                yield future.result()
            except AbsentError as missing:
                yield missing


def stored(line: Line) -> str:
    """A line as it is written."""
    return json.dumps(line, default=_plain)


def _plain(value: Any) -> Any:
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    return value.tolist() if hasattr(value, "tolist") else float(value)
