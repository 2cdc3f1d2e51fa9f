import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor

import pytest
from engine_cases import AMPLITUDE, METRIC, TOOTHED, study

from hdsim.errors import InputError
from hdsim.studies.engine.execute import batches, execute, executor
from hdsim.studies.engine.reading import plan
from hdsim.studies.engine.study import JOURNAL, run_study
from hdsim.studies.engine.table import study_table
from hdsim.studies.engine.worker import Job

PITCH = "drive.mesh.pitch_error_m"


def toothed(runs=12, **given):
    return plan(
        study(
            TOOTHED,
            parameters={PITCH: {"type": "loguniform", "low": 1e-7, "high": 2e-6}},
            sampling={"type": "latin_hypercube", "samples": runs},
            **given,
        )
    )


def csv_of(result, path):
    return result.table.write_csv(path).read_bytes()


def test_planted_amplitudes_come_out_run_by_run(tmp_path):
    values = [0.25, 0.5, 1.0, 2.0]
    result = run_study(plan(study(parameters={AMPLITUDE: {"type": "list", "values": values}})), tmp_path)
    # 2 A in arcsec, sampled 400 times in a turn.
    assert result.table.values(METRIC) == pytest.approx([120 * a for a in values], rel=2e-4)
    assert result.table.columns["status"].values == ["ok"] * 4


@pytest.mark.slow
def test_two_processes_give_the_same_table_as_one(tmp_path):
    one = csv_of(run_study(toothed(), tmp_path / "1", workers=1), tmp_path / "1.csv")
    two = csv_of(run_study(toothed(), tmp_path / "2", workers=2), tmp_path / "2.csv")
    assert one == two
    numbers = [line.split(b",")[6] for line in one.splitlines()[1:]]
    assert len(set(numbers)) == 12  # every run has its own drive


def test_order_and_size_of_batches_do_not_matter():
    checked = toothed(6)
    jobs = [Job(run.index, run.seed, run.values) for run in checked.runs]
    tables = []
    for ordered, width in ((jobs, 1), (jobs[::-1], 1000)):
        rows = {}
        with executor(1) as (pool, _):
            cut = batches(checked.recipe, [METRIC], ordered, width)
            execute(cut, pool, 1, lambda done, rows=rows: rows.update({row.index: row for row in done}))
        tables.append(study_table(checked, rows))
    assert tables[0].columns == tables[1].columns


def test_batches_hold_at_most_fifty_runs_and_all_of_them():
    checked = toothed(3)
    jobs = [Job(k, k, (1e-6,)) for k in range(1001)]
    for width in (1, 2, 64):
        cut = batches(checked.recipe, [METRIC], jobs, width)
        assert max(len(batch.jobs) for batch in cut) <= 50
        assert [job for batch in cut for job in batch.jobs] == jobs
    assert len(batches(checked.recipe, [METRIC], jobs, 1)) == 21


def test_failing_runs_are_rows_with_their_reason(tmp_path):
    # Below T1 is no place for T2: each value is possible alone, some pairs are not.
    names = ["drive.torsion.torque_t1_nm", "drive.torsion.torque_t2_nm"]
    checked = plan(
        study(
            parameters={
                names[0]: {"type": "list", "values": [7.0, 20.0]},
                names[1]: {"type": "list", "values": [15.0, 25.0]},
            }
        )
    )
    table = run_study(checked, tmp_path).table
    assert table.columns["status"].values == ["ok", "ok", "failed", "ok"]
    assert "torque_t2_nm must exceed torque_t1_nm, found 15.0 <= 20.0" in table.columns["reason"].values[2]
    assert table.columns[METRIC].values[2] is None
    line = table.write_csv(tmp_path / "r.csv").read_text().splitlines()[3]
    assert line.startswith("2,2,0,0,")
    assert ",,failed," in line


def test_metric_that_does_not_fit_the_run_is_a_reason_and_the_others_are_kept(tmp_path):
    table = run_study(plan(study(metrics=[METRIC, "hysteresis_loss"])), tmp_path).table
    assert table.columns["status"].values == ["failed"]
    assert table.columns["reason"].values[0].startswith("hysteresis_loss: ")
    assert table.values(METRIC) == pytest.approx([60.0], rel=1e-3)


def test_finished_study_makes_no_run_again_and_another_one_is_refused(tmp_path):
    checked = plan(study(replicates=3))
    first = run_study(checked, tmp_path)
    again = run_study(checked, tmp_path)
    assert (first.made, again.made) == (3, 0)
    assert again.table.columns == first.table.columns
    with pytest.raises(InputError, match="another study"):
        run_study(plan(study(replicates=4)), tmp_path)
    assert run_study(plan(study(replicates=4)), tmp_path, fresh=True).made == 4


@pytest.mark.parametrize(
    "damage", [lambda raw: raw[:-9], lambda raw: raw + b'{"run": 9', lambda raw: raw + b"\0\0\n"]
)
def test_cut_or_torn_last_line_is_made_again(tmp_path, damage):
    checked = plan(study(replicates=3))
    whole = run_study(checked, tmp_path).table
    path = tmp_path / JOURNAL
    path.write_bytes(damage(path.read_bytes()))
    again = run_study(checked, tmp_path)
    assert again.table.columns == whole.columns
    assert [json.loads(line).get("run") for line in path.read_text().splitlines()] == [None, 0, 1, 2]


def test_file_in_use_is_refused(tmp_path):
    pytest.importorskip("fcntl")
    from hdsim.studies.engine.journal import Journal

    with Journal(tmp_path / JOURNAL, "key"), pytest.raises(InputError, match="in use"):
        Journal(tmp_path / JOURNAL, "key")


def test_logs_are_kept_and_give_the_same_metrics(tmp_path):
    from hdsim.log import open_log

    plain = run_study(toothed(2), tmp_path / "plain").table
    logged = run_study(toothed(2, keep_logs=True), tmp_path / "logged").table
    assert logged.columns[METRIC].values == plain.columns[METRIC].values
    logs = sorted((tmp_path / "logged" / "logs").glob("*.mcap"))
    assert [log.name for log in logs] == ["run-000000.mcap", "run-000001.mcap"]
    assert open_log(logs[1]).metadata["seed"] == str(logged.columns["seed"].values[1])


def test_any_executor_will_do():
    class Recording(Executor):
        def __init__(self):
            from concurrent.futures import ThreadPoolExecutor

            self.inner, self.tasks = ThreadPoolExecutor(1), 0

        def submit(self, fn, /, *args, **kwargs):
            self.tasks += 1
            return self.inner.submit(fn, *args, **kwargs)

    checked = plan(study(replicates=5))
    jobs = [Job(run.index, run.seed, run.values) for run in checked.runs]
    rows, pool = [], Recording()
    execute(batches(checked.recipe, [METRIC], jobs, 1), pool, 1, rows.extend)
    assert pool.tasks == 5
    assert sorted(row.index for row in rows) == list(range(5))


STUDY = """\
name: killed
base:
  scenario:
    name: toothed
    drive: {preset: seed-2021}
    effects: {kinematic_error: {}}
    command: {motor: {type: motion, trajectory: {type: ramp, velocity_rpm: 300}}}
    load: {inertia_kg_m2: 0.05}
    run: {duration_s: 0.4, sample_rate_hz: 2000, teeth_rate_hz: 0}
parameters:
  drive.mesh.pitch_error_m: {type: loguniform, low: 1.0e-7, high: 2.0e-6}
sampling: {type: random, samples: 120}
metrics: [transmission_error_peak_to_peak, transmission_error_rms]
"""
COMMAND = "import sys; from hdsim.studies.commands_engine import study; study()"


def command(path, folder, *more):
    return [sys.executable, "-c", COMMAND, str(path), "-o", str(folder), *more]


def children(pid):
    found = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False
    )
    return [int(line) for line in found.stdout.split()]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Folder of the study that nobody killed."""
    folder = tmp_path_factory.mktemp("whole")
    path = folder / "killed.yaml"
    path.write_text(STUDY)
    subprocess.run(command(path, folder / "whole"), check=True, capture_output=True)
    return folder / "whole"


@pytest.mark.slow
@pytest.mark.parametrize("workers", [pytest.param("1", marks=pytest.mark.study), "2"])
def test_study_killed_at_the_half_goes_on_and_gives_the_identical_table(tmp_path, whole, workers):
    path = tmp_path / "killed.yaml"
    path.write_text(STUDY)
    folder = tmp_path / "killed"
    journal = folder / JOURNAL
    running = subprocess.Popen(command(path, folder, "--workers", workers), stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not (journal.exists() and journal.read_bytes().count(b"\n") > 60):
        assert running.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.005)
    workers_left = children(running.pid)
    running.send_signal(signal.SIGKILL)
    running.wait()
    done = journal.read_bytes().count(b"\n") - 1
    assert 60 <= done < 120
    again = subprocess.run(
        command(path, folder, "--workers", workers), check=True, capture_output=True, text=True
    )
    assert f"{done} of them from before" in again.stdout
    for name in ("results.csv", "results.parquet", "summary.csv", "provenance.json"):
        assert (folder / name).read_bytes() == (whole / name).read_bytes()
    for pid in workers_left:  # no worker outlives the study that was killed
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


@pytest.mark.slow
def test_dask_cluster_gives_the_identical_table(tmp_path):
    distributed = pytest.importorskip("distributed")
    expected = csv_of(run_study(toothed(), tmp_path / "here"), tmp_path / "here.csv")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        result = run_study(toothed(), tmp_path / "dask", scheduler=cluster.scheduler_address)
        assert result.made == 12
        assert csv_of(result, tmp_path / "dask.csv") == expected


def test_scheduler_that_does_not_answer_is_an_input_error(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    real = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda address, timeout: real(address, timeout="0.5s"))
    with pytest.raises(InputError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1"):
        run_study(plan(study()), tmp_path, scheduler="tcp://127.0.0.1:1")
