"""Run the blind matrix and print it whole: ``python tests/blind [SEEDS] [GROUP,GROUP] [--write FILE]``."""

from __future__ import annotations

import sys
import time
from collections import Counter, defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from cases import Trial, trials
from judging import judge, outcome


def main() -> None:
    given = [a for a in sys.argv[1:] if not a.startswith("--")]
    seeds = int(given[0]) if given else 1
    groups = set(given[1].split(",")) if len(given) > 1 else None
    rows: list[tuple[Trial, str, bool, float]] = []
    for trial in trials(seeds):
        if groups and trial.group not in groups:
            continue
        started = time.perf_counter()
        said = outcome(trial)
        rows.append((trial, said.text, judge(trial, said), time.perf_counter() - started))
        mark = "right" if rows[-1][2] else "WRONG"
        print(
            f"{trial.group:10} {trial.case.truth:50} seed {trial.case.seed}: {mark} {said.text} "
            f"({rows[-1][3]:.0f} s)",
            flush=True,
        )
    text = matrix(rows)
    print(text)
    if "--write" in sys.argv:
        Path(sys.argv[sys.argv.index("--write") + 1]).write_text(text, encoding="utf-8")


def matrix(rows: list[tuple[Trial, str, bool, float]]) -> str:
    """The confusion matrix and the rates as Markdown."""
    found: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for trial, said, _, _ in rows:
        found[trial.group, trial.case.truth][said] += 1
    lines = ["| group | hidden | said |", "|---|---|---|"]
    for (group, truth), said in found.items():
        lines.append(
            f"| {group} | {truth} | {'; '.join(f'{text} ({n})' for text, n in said.most_common())} |"
        )
    lines += ["", "| group | cases | right | s a case |", "|---|---|---|---|"]
    for group in dict.fromkeys(trial.group for trial, *_ in rows):
        own = [(right, seconds) for trial, _, right, seconds in rows if trial.group == group]
        share = sum(right for right, _ in own) / len(own)
        lines.append(
            f"| {group} | {len(own)} | {100 * share:.0f} % | {sum(s for _, s in own) / len(own):.0f} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
