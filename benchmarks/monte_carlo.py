"""Rate of a Monte-Carlo study of the transmission error, with one and with two workers.

    python benchmarks/monte_carlo.py [RUNS]

The study is ``scenarios/studies/te_monte_carlo.yaml``: one drive with other random tooth surfaces, pitch
errors and kinematic error in every run, one output turn each way. Both rates are steady: the workers' start
is timed apart.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

STUDY = Path(__file__).parents[1] / "scenarios" / "studies" / "te_monte_carlo.yaml"
#: What the study is to reach on two cores.
LONGEST_S, LEAST_RATIO = 300.0, 1.8


def main(runs: int) -> int:
    from hdsim.study.engine.execute import batches, execute, executor
    from hdsim.study.engine.reading import load_study, plan
    from hdsim.study.engine.study import run_study
    from hdsim.study.engine.worker import Job, run_batch

    study = load_study(STUDY).study
    checked = plan(study.model_copy(update={"sampling": study.sampling.model_copy(update={"samples": runs})}))
    names = [metric.name for metric in checked.metrics]
    jobs = [Job(run.index, run.seed, run.values) for run in checked.runs]
    run_batch(batches(checked.recipe, names, jobs[:1], 1)[0])

    rates = {}
    few = jobs[: max(60, runs // 5)]
    for workers in (1, 2):
        with executor(workers) as (pool, width):
            # One run each, so that processes and compiled code are there before the clock starts.
            execute(batches(checked.recipe, names, jobs[: 2 * width], width), pool, width, lambda rows: None)
            started = time.perf_counter()
            execute(batches(checked.recipe, names, few, width), pool, width, lambda rows: None)
            rates[workers] = len(few) / (time.perf_counter() - started)
        print(f"{workers} worker(s): {rates[workers]:.2f} runs a second ({len(few)} runs)")
    ratio = rates[2] / rates[1]
    print(f"ratio {ratio:.2f} (wanted: at least {LEAST_RATIO})")

    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        result = run_study(checked, Path(folder), workers=2)
        seconds = time.perf_counter() - started
    failed = result.table.columns["status"].values.count("failed")
    print(f"{runs} runs on 2 workers: {seconds:.1f} s with start and journal, {failed} failed")
    longest = LONGEST_S * runs / 1000
    print(f"wanted: at most {longest:.0f} s")
    return 0 if ratio >= LEAST_RATIO and seconds <= longest and not failed else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000))
