"""Run the blind matrix and write it whole; ``python tests/blind --help``."""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import multiprocessing
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cases import Trial, trials
from judging import attempt
from matrix import page


def seeds_of(text: str) -> list[int]:
    """``100-103`` or ``0,2`` as numbers."""
    found: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


def wanted(given: argparse.Namespace) -> list[Trial]:
    """The trials that were asked for."""
    if given.only:
        seed = int(given.only.rpartition("/")[2])
        return [t for t in trials([seed]) if t.key == given.only]
    groups = set(given.groups.split(",")) if given.groups else None
    found = [t for t in trials(seeds_of(given.seeds)) if groups is None or t.group in groups]
    return [t for t in found if given.match in t.key]


def done(path: Path | None, keys: set[str]) -> dict[str, dict[str, Any]]:
    """Results of an earlier run, by key; a line that was cut off is left out."""
    found = {}
    if path is not None and path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                result = json.loads(line)
            except json.JSONDecodeError:
                continue
            if result["key"] in keys:
                found[result["key"]] = result
    return found


def run(todo: list[Trial], jobs: int) -> Iterator[dict[str, Any]]:
    """Results as they come."""
    if jobs == 1:
        yield from map(attempt, todo)
        return
    # One thread a process: the processes are what runs side by side.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(jobs, mp_context=context) as pool:
        for future in concurrent.futures.as_completed([pool.submit(attempt, trial) for trial in todo]):
            yield future.result()


def line_of(result: dict[str, Any]) -> str:
    """A result in a line."""
    sizes = " ".join(f"{s[1]:.1f}({s[0]:.1f})" for s in result["strength"]) or "-"
    return " | ".join(
        [
            f"{result['key']}: {'right' if result['right'] else 'WRONG'}",
            result.get("error") or result["said"],
            result["setup"],
            f"strength {sizes}",
            f"closed {result.get('closed')}",
            f"{result['made_s']:.0f} + {result['seconds']:.0f} s",
        ]
    )


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python tests/blind", description=__doc__)
    parser.add_argument("--seeds", default="100-102", help="e.g. 100-102 or 0,2 (below 100: development)")
    parser.add_argument("--groups", default="", help="comma-separated; all without it")
    parser.add_argument("--match", default="", help="only cases whose key contains this")
    parser.add_argument("--only", default="", help="one case: group/truth/seed")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--results", type=Path, help="JSON-lines file: cases in it are not run again")
    parser.add_argument("--write", type=Path, help="write the page here")
    parser.add_argument("--known", action="store_true", help="run nothing, report what --results holds")
    parser.add_argument("--list", action="store_true", help="only list the keys")
    given = parser.parse_args()
    chosen = wanted(given)
    if not chosen:
        parser.error("no case fits")
    if given.list:
        print("\n".join(t.key for t in chosen))
        return
    results = done(given.results, {t.key for t in chosen})
    if given.known:
        chosen = [t for t in chosen if t.key in results]
    todo = [t for t in chosen if t.key not in results]
    print(f"{len(chosen)} cases, {len(results)} of them known", flush=True)
    started = time.perf_counter()
    for number, result in enumerate(run(todo, given.jobs), 1):
        results[result["key"]] = result
        if given.results:
            with given.results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(result, default=float) + "\n")
        left = (time.perf_counter() - started) / number * (len(todo) - number) / 60
        print(f"[{number}/{len(todo)}, {left:.0f} min left] {line_of(result)}", flush=True)
        if given.only:
            print(json.dumps(result, indent=1, default=float))
    text = page([results[t.key] for t in chosen])
    if given.write:
        given.write.write_text(text, encoding="utf-8")
    if not given.only:
        print(text)


if __name__ == "__main__":
    main()
