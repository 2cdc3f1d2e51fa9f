"""Rate of a Monte-Carlo study of the transmission error, with one and with two workers.

    python benchmarks/monte_carlo.py [RUNS]

The study is ``scenarios/studies/te_monte_carlo.yaml``: one drive with other random tooth surfaces, pitch
errors and kinematic error in every run, one output turn each way. Both rates are steady: the workers' start
is timed apart.
"""

from __future__ import annotations

import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path

STUDY = Path(__file__).parents[1] / "scenarios" / "studies" / "te_monte_carlo.yaml"
#: What the study is to reach on two cores.
LONGEST_S, LEAST_RATIO = 300.0, 1.8
ROUNDS = 5


def main(runs: int) -> int:
    from hdsim.studies.engine.execute import batches, execute, executor
    from hdsim.studies.engine.reading import load_study, plan
    from hdsim.studies.engine.study import run_study
    from hdsim.studies.engine.worker import Job, run_batch

    study = load_study(STUDY).study
    checked = plan(study.model_copy(update={"sampling": study.sampling.model_copy(update={"samples": runs})}))
    names = [metric.name for metric in checked.metrics]
    jobs = [Job(run.index, run.seed, run.values) for run in checked.runs]
    run_batch(batches(checked.recipe, names, jobs[:1], 1)[0])

    few = jobs[: max(40, runs // 20)]
    rates: dict[int, list[float]] = {1: [], 2: []}
    with executor(1) as one, executor(2) as two:
        for pool, width in (one, two):
            # One run each, so that processes and compiled code are there before the clock starts.
            execute(batches(checked.recipe, names, jobs[: 2 * width], width), pool, width, lambda rows: None)
        # In turns, so that whatever else the machine does meets both alike.
        for _ in range(ROUNDS):
            for workers, (pool, width) in ((1, one), (2, two)):
                started = time.perf_counter()
                execute(batches(checked.recipe, names, few, width), pool, width, lambda rows: None)
                rates[workers].append(len(few) / (time.perf_counter() - started))
    for workers, found in rates.items():
        print(f"{workers} worker(s): {max(found):.2f} runs a second (best of {ROUNDS} times {len(few)} runs)")
    ratio = statistics.median(b / a for a, b in zip(rates[1], rates[2], strict=True))
    print(f"ratio {ratio:.2f}, median of the rounds (wanted: at least {LEAST_RATIO})")

    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        result = run_study(checked, Path(folder), workers=2)
        seconds = time.perf_counter() - started
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN)
    failed = result.table.columns["status"].values.count("failed")
    print(f"{runs} runs on 2 workers: {seconds:.1f} s with start and journal, {failed} failed")
    print(f"all processes so far: {cpu.ru_utime + cpu.ru_stime:.0f} s of CPU time")
    longest = LONGEST_S * runs / 1000
    print(f"wanted: at most {longest:.0f} s")
    return 0 if ratio >= LEAST_RATIO and seconds <= longest and not failed else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000))
