"""A verdict is a function of data and model: of neither what the process did before, nor of its threads."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

#: Diagnoses a record in a process that has just begun, another one, and the first again; prints every digit,
#: and before them the threads of each library of linear algebra at every step.
TWICE = """
import sys
from pathlib import Path

import numpy as np
from diagnose_bench import rigid_record, scenario
from threadpoolctl import threadpool_info

from hdsim.diagnosis.workflow import diagnose
from hdsim.estimate.estimation import estimate

model = scenario(Path(sys.argv[1]))
threads = set()


def look(_):
    threads.update(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")


def ripple(angle, velocity):
    return 0.01 * np.sin(2 * angle)


if sys.argv[2] == "fit":
    estimate([rigid_record()], model, on_step=look)
    print(threads)
else:
    for seed in (1, 2, 1):
        found = diagnose([rigid_record(seed=seed, extra=ripple)], model, on_step=look)
        print(threads)
        print(found.verdict.model_copy(update={"seconds": {}}).model_dump_json())
        print(found.final.covariance.tolist())
"""


def printed(script: str, *arguments: str) -> list[str]:
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2", "MKL_NUM_THREADS": "2"}
    environment["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    command = [sys.executable, "-c", script, *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
def test_linear_algebra_has_one_thread_in_the_first_fit_of_a_process(tmp_path):
    assert printed(TWICE, str(tmp_path), "fit") == ["{1}"]


@pytest.mark.slow
def test_the_same_diagnosis_after_another_one_gives_every_digit_again(tmp_path):
    lines = printed(TWICE, str(tmp_path), "diagnose")
    first, another, again = lines[:3], lines[3:6], lines[6:]
    assert first[0] == "{1}"
    assert first == again
    assert first != another
