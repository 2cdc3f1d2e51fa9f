"""How long the commands that simulate nothing take to start, beside Python itself and beside importing numba.

    python benchmarks/start_up.py

Prints the best of several runs, in processor seconds of the whole process, and the ratio to bare Python.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

SCENARIO = Path(__file__).parents[1] / "scenarios" / "seed_move.yaml"
RUNS = 7
COMMANDS = {
    "python": ["-c", "pass"],
    "hdsim --help": ["-m", "hdsim.cli", "--help"],
    "hdsim check": ["-m", "hdsim.cli", "check", str(SCENARIO)],
    "import numba": ["-c", "import numba"],
    "import control": ["-c", "import control"],
}


def seconds(arguments: list[str]) -> float:
    """Processor seconds of one run, system calls included."""

    def spent() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = spent()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    return spent() - before


def main() -> None:
    """Print the table."""
    bare = None
    print(f"{'command':<16} {'seconds':>8} {'ratio':>6}")
    for name, arguments in COMMANDS.items():
        best = min(seconds(arguments) for _ in range(RUNS))
        bare = bare or best
        print(f"{name:<16} {best:8.3f} {best / bare:6.1f}")


if __name__ == "__main__":
    main()
