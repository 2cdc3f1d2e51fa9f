"""Blind tests of the diagnosis: ``python tests/blind --help``."""

from __future__ import annotations

import argparse
import importlib
import json
import time
from dataclasses import replace
from pathlib import Path

from contract import AbsentError
from judging import Line, outcome, said
from running import FAMILIES, KEPT, Task, attempt, family, keep, lines_of, run, store, stored, task_of

#: Never used to calibrate, whatever its seeds: what is stated of it, no rule has seen.
LEFT_OUT = "mujoco"


def numbers_of(text: str) -> list[int]:
    """``0-49`` or ``0,2`` as numbers."""
    found: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


def line_of(line: Line) -> str:
    """A result in a line."""
    setup = line["setup"]
    seconds = setup.get("seconds", 0.0)
    total = sum(seconds) if isinstance(seconds, list) else seconds
    return " | ".join(
        [
            f"{line['key']}: {outcome(line)}",
            said(line),
            f"{setup.get('sensors', '')}, {setup.get('rate_hz', 0):.0f} Hz, {total:.0f} s",
            f"held {setup.get('held', '')}",
            f"strength {' '.join(f'{s:.1f}' for s in line['strength']) or '-'}",
            f"closed {line.get('closed')}",
            f"{line.get('made_cpu_s', 0):.0f} + {line.get('cpu_s', 0):.0f} s",
        ]
    )


def tasks(given: argparse.Namespace) -> list[Task]:
    """The cases that were asked for, of the families that are here."""
    wanted: list[Task] = []
    for name in given.families.split(","):
        try:
            family(name)
        except AbsentError as missing:
            print(f"skipped: {missing}")
            continue
        numbers, seeds = numbers_of(given.numbers), numbers_of(given.seed)
        wanted += [Task(name, n, seed, given.most_samples, given.cases) for seed in seeds for n in numbers]
    # Families in turn, so that a part of the run has all of them.
    wanted.sort(key=lambda task: (task.seed, task.number))
    return wanted


def draw_all(given: argparse.Namespace) -> None:
    """Draw cases and keep them, so that runs need not draw them again."""
    todo = tasks(given)
    for count, line in enumerate(run(todo, given.jobs, keep), 1):
        text = line if isinstance(line, AbsentError) else f"{line['key']} {line['error'] or ''}"
        print(f"[{count}/{len(todo)}] {text}", flush=True)


def run_all(given: argparse.Namespace) -> None:
    """Run the cases that were asked for and are not stored yet."""
    wanted = tasks(given)
    given.results.parent.mkdir(parents=True, exist_ok=True)
    known = {Task(r["family"], r["number"], r["seed"]) for r in lines_of([given.results])}
    todo = [task for task in wanted if task not in known]
    print(f"{len(wanted)} cases, {len(wanted) - len(todo)} of them known", flush=True)
    started = time.perf_counter()
    for count, line in enumerate(run(todo, given.jobs), 1):
        left = (time.perf_counter() - started) / count * (len(todo) - count) / 60
        if isinstance(line, AbsentError):
            print(f"[{count}/{len(todo)}] skipped: {line}", flush=True)
            continue
        with given.results.open("a", encoding="utf-8") as file:
            file.write(stored(line) + "\n")
        print(f"[{count}/{len(todo)}, {left:.0f} min left] {line_of(line)}", flush=True)


def one(given: argparse.Namespace) -> None:
    """Run one case again and print what comes of it."""
    line = attempt(replace(task_of(given.key), cases=given.cases))
    print(json.dumps(json.loads(stored(line | {"evidence": None})), indent=1))
    print(line_of(line))


def show(given: argparse.Namespace) -> None:
    """Print stored lines of a key, or of all keys that hold the text."""
    found = [line for line in lines_of(given.results) if given.key in line["key"]]
    for line in found:
        if line["key"] == given.key or len(found) == 1:
            print(json.dumps(line | {"evidence": None}, indent=1))
        print(line_of(line))
    if not found:
        raise SystemExit(f"no stored case has {given.key} in its key")


def page(given: argparse.Namespace) -> None:
    """Write the page of stored cases, and the picture beside it."""
    import page as pages

    lines = lines_of(given.results)
    given.write.parent.mkdir(parents=True, exist_ok=True)
    given.write.write_text(pages.page(lines), encoding="utf-8")
    pages.reliability_picture(
        [r for r in lines if pages.states(r)], given.write.parent / "images" / "reliability.png"
    )
    print(f"{len(lines)} cases: {given.write}")


def keep_all(given: argparse.Namespace) -> None:
    """Pack stored cases into the file that the page is written from."""
    lines = lines_of(given.results)
    store(lines, given.write)
    print(f"{len(lines)} cases: {given.write}, {given.write.stat().st_size / 1e6:.1f} MB")


def calibrate(given: argparse.Namespace) -> None:
    """Hand the lines that rules may be calibrated on to ``calibrate.calibrate``."""
    lines = lines_of(given.results)
    refused = sorted({line["key"] for line in lines if line["family"] == LEFT_OUT or line["seed"] % 2})
    if refused:
        raise SystemExit(
            f"{len(refused)} of {len(lines)} cases must not calibrate anything (the {LEFT_OUT} family is "
            f"left out, odd seeds are for the statement): {', '.join(refused[:3])}"
        )
    importlib.import_module("calibrate").calibrate(lines)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python tests/blind", description=__doc__)
    commands = parser.add_subparsers(required=True)

    def paths(text: str) -> list[Path]:
        return [Path(part) for part in text.split(",")]

    for name, call, text in (
        ("draw", draw_all, "draw cases and keep them"),
        ("run", run_all, "draw cases, diagnose them, store a line each"),
    ):
        command = commands.add_parser(name, help=text)
        command.add_argument("--families", default=",".join(FAMILIES))
        command.add_argument("--numbers", default="0-49", help="e.g. 0-49 or 3,7")
        command.add_argument(
            "--seed", default="1", help="even: calibration, odd: statement; several as for --numbers"
        )
        command.add_argument("--jobs", type=int, default=1, help="processes")
        command.add_argument("--cases", type=Path, default=None, metavar="FOLDER",
                             help="where drawn cases are kept, and taken from")  # fmt: skip
        command.add_argument("--most-samples", type=int, default=10**9, metavar="N",
                             help="leave out cases whose records hold more samples together")  # fmt: skip
        command.add_argument("--results", type=Path, default=Path("results/blind.jsonl"),
                             help="JSON-lines file: cases in it are not run again")  # fmt: skip
        command.set_defaults(run=call)
    command = commands.add_parser("one", help="run one case again, print the verdict")
    command.add_argument("key", help="family/kind/truth/number/seed")
    command.add_argument("--cases", type=Path, default=None, metavar="FOLDER",
                         help="where drawn cases are kept")  # fmt: skip
    command.set_defaults(run=one)
    # Of a case that stands in several files the last one counts: the newer after the kept.
    new = Path("results/blind.jsonl")
    for name, call, results, text in (
        ("show", show, [KEPT, new], "print stored cases whose key holds the text"),
        ("store", keep_all, [KEPT, new], "pack stored cases into the file that the page is written from"),
        ("page", page, [KEPT], "write the page"),
        ("calibrate", calibrate, [new], "calibrate rules on stored cases of even seeds"),
    ):
        command = commands.add_parser(name, help=text)
        if name == "show":
            command.add_argument("key")
        if name in ("page", "store"):
            command.add_argument(
                "--write", type=Path, default=Path("docs/blind.md") if name == "page" else KEPT
            )
        command.add_argument("--results", type=paths, default=results,
                             help="files, comma-separated")  # fmt: skip
        command.set_defaults(run=call)
    given = parser.parse_args()
    given.run(given)


if __name__ == "__main__":
    main()
