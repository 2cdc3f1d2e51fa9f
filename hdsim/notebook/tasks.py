"""One call per task: what the commands do, with files or with objects, and the result as an object."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from hdsim.errors import InputError
from hdsim.scenario import loaded

if TYPE_CHECKING:
    import pandas

    from hdsim.diagnosis.workflow import Diagnosis
    from hdsim.estimate.estimation import Estimation
    from hdsim.estimate.offsets import Zeros
    from hdsim.estimate.plan import LoadSource
    from hdsim.estimate.records import Record
    from hdsim.log.mapping import Mapping as ColumnMapping
    from hdsim.recording import Recording
    from hdsim.scenario import Scenario
    from hdsim.simulation.inputs import MotorInput, OutputInput
    from hdsim.simulation.stepped import SteppedPlant
    from hdsim.simulation.stepped_batch import SteppedPlants
    from hdsim.studies.engine.study import StudyResult

    AnyScenario: TypeAlias = str | Path | Scenario
    #: A file, a recording of hdsim's, a record of a fit's, or a data frame.
    Measured: TypeAlias = str | Path | Recording | Record | pandas.DataFrame
    AnyMapping: TypeAlias = str | Path | dict[str, Any] | ColumnMapping


def diagnose(
    measured: Measured | Sequence[Measured],
    scenario: AnyScenario,
    *,
    mapping: AnyMapping | None = None,
    holdout: Measured | Sequence[Measured] = (),
    load: LoadSource | None = None,
    zeros: Zeros = "campaign",
    force: bool = False,
    black_box: bool = False,
    thorough: bool = False,
    all_data: bool = False,
    out: str | Path | None = None,
    on_step: Callable[[str], object] | None = None,
) -> Diagnosis:
    """Find which physical effect a model is missing; ``hdsim diagnose`` as a function.

    >>> hdsim.diagnose("log.csv", "base.yaml", mapping="mapping.yaml")
    >>> hdsim.diagnose(frame, scenario, mapping={"time": {"column": "t", "unit": "s"}, "channels": ...})

    Args:
        measured: one record or several: a file, a recording, or a pandas data frame.
        scenario: the model, or its file; its command does not matter, as the measured motion is prescribed.
        mapping: assigns the columns of files and data frames to channels: a mapping file or the same as a
            dictionary. A log of hdsim needs none.
        holdout: validation records, used in no fit; parts of ``measured`` when there are none.
        load: source of the load torque; ``load_torque`` when that is measured, else the scenario.
        zeros: whether a torque sensor has one zero in all records, one in each, or is trusted to have none.
        force: continue in spite of errors in the data.
        black_box: also fit gradient-boosted trees as a baseline (``hdsim[baseline]``).
        thorough: look for a third effect and more however long that takes.
        all_data: estimate the parameters again from held-out stretches too, once these have judged the model.
        out: folder for the report, the log and the scenario with the result (``verdict.scenario``);
            needs the scenario's file.
        on_step: called with the name of each step.

    Returns:
        The diagnosis; ``verdict`` is its summary. A notebook displays it as a page.

    Raises:
        InputError: a file, a mapping or the scenario is wrong, or the data cannot answer the question.
    """
    from hdsim.diagnosis.workflow import diagnose as run

    base = _file_for(scenario, out)
    records, held = _records(measured, mapping), _records(holdout, mapping)
    found = run(
        records, loaded(scenario), holdout=held, load=load, zeros=zeros, force=force, black_box=black_box,
        thorough=thorough, all_data=all_data, on_step=on_step,
    )  # fmt: skip
    if base is not None and out is not None:
        from hdsim.tell.save import save

        save(found, base, out)
    return found


def fit(
    measured: Measured | Sequence[Measured],
    scenario: AnyScenario,
    *,
    mapping: AnyMapping | None = None,
    holdout: Measured | Sequence[Measured] = (),
    free: Collection[str] = (),
    fix: Collection[str] = (),
    apart: Collection[str] = (),
    load: LoadSource | None = None,
    zeros: Zeros = "campaign",
    force: bool = False,
    black_box: bool = False,
    all_data: bool = False,
    out: str | Path | None = None,
    on_step: Callable[[str], object] | None = None,
) -> Estimation:
    """Estimate a scenario's parameters from measured records; ``hdsim fit`` as a function.

    >>> found = hdsim.fit(recording, scenario, free=["drive.friction.coulomb_nm"])
    >>> better = scenario.with_(found.changes)

    Args:
        measured: as for `diagnose`.
        scenario: likewise.
        mapping: likewise.
        holdout: likewise.
        free: paths of the only free parameters; all that the model declares when empty. Parameters of a group
            that are given together scale together.
        fix: paths of parameters that stay fixed.
        apart: paths of parameters of a group that are estimated by themselves.
        load: as for `diagnose`.
        zeros: likewise.
        force: likewise.
        black_box: likewise.
        all_data: likewise.
        out: folder for ``fit.json``, the page and ``fitted.yaml``; needs the scenario's file.
        on_step: called with the name of each step.

    Returns:
        The estimates with confidence intervals and correlations, and what is not identifiable.

    Raises:
        InputError: as `diagnose`, or a path is none.
    """
    from hdsim.estimate.estimation import estimate

    base = _file_for(scenario, out)
    records, held = _records(measured, mapping), _records(holdout, mapping)
    found = estimate(
        records, loaded(scenario), holdout=held, free=free, fix=fix, apart=apart, load=load, zeros=zeros,
        force=force, black_box=black_box, all_data=all_data, on_step=on_step,
    )  # fmt: skip
    if base is not None and out is not None:
        from hdsim.tell.fit_report import save_fit

        save_fit(found, base, out)
    return found


def study(
    base: AnyScenario,
    parameters: Mapping[str, Any] | None = None,
    metrics: str | Sequence[str] = (),
    *,
    workers: int = 1,
    out: str | Path | None = None,
    on_progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> StudyResult:
    """Make many runs of a scenario; ``hdsim study`` as a function.

    >>> hdsim.study("study.yaml", workers=2)
    >>> hdsim.study(scenario, {"load.inertia_kg_m2": [0.1, 0.3, 1.0]}, "positioning_error", replicates=5)

    Args:
        base: a study's file; or, with ``metrics``, the scenario or its file.
        parameters: what varies, by the dotted name of a scenario's field: its values as a list, or as in a
            study's file (``{"type": "uniform", "low": 0.1, "high": 1.0}``).
        metrics: what is computed of every run.
        workers: processes on this machine.
        out: folder of table, summary and figures; a study that was stopped continues there. Nothing is
            kept when None.
        on_progress: called with the number of runs that are done and of all runs.
        options: other fields of a study: ``sampling``, ``replicates``, ``seed``, ``name``, ...

    Returns:
        The table of all runs; ``to_pandas()`` gives it as a data frame.

    Raises:
        InputError: the study is wrong, with one line for every mistake.
    """
    from hdsim.studies.engine.study import run_study, write_results

    plan = _plan(base, parameters, metrics, options)
    with ExitStack() as kept:
        folder = Path(kept.enter_context(TemporaryDirectory()) if out is None else out)
        folder.mkdir(parents=True, exist_ok=True)
        found = run_study(plan, folder, workers=workers, on_progress=on_progress)
        if out is not None:
            write_results(found, folder)
    return found


def plant(
    scenario: AnyScenario, *, motor: MotorInput | None = None, output: OutputInput | None = None
) -> SteppedPlant:
    """One joint that your own control loop advances, step by step.

    >>> joint = hdsim.plant("scenarios/seed_move.yaml", motor="torque")
    >>> joint.step(1e-3, {"motor_torque": 0.1})
    >>> joint.values(["output_angle", "output_torque"])

    Args:
        scenario: the joint, or its file.
        motor: input on the motor's side: ``torque``, ``angle`` or ``velocity`` of the scenario's controller,
            or ``motion``; what the scenario's command is when None.
        output: ``torque`` or ``motion``; what the scenario's output does when None.

    Raises:
        InputError: the scenario is wrong, has no such command, or its controller is sampled.
    """
    from hdsim.simulation.stepped import SteppedPlant

    return SteppedPlant(loaded(scenario), motor=motor, output=output)


def plants(
    scenarios: Sequence[AnyScenario],
    *,
    motor: MotorInput | None = None,
    output: OutputInput | None = None,
    threads: int = 1,
) -> SteppedPlants:
    """N joints that differ in parameters and seeds, advanced together: inputs and outputs have shape (N,).

    >>> loads = np.linspace(0.1, 1.0, 64)
    >>> drives = [scenario.with_({"load.inertia_kg_m2": load}) for load in loads]
    >>> joints = hdsim.plants(drives, motor="torque")

    Args:
        scenarios: one for each joint; they have the same mesh, effects and commands.
        motor: as for `plant`.
        output: likewise.
        threads: threads that share the joints.

    Raises:
        InputError: as `plant`, or a joint is built otherwise than the first.
    """
    from hdsim.simulation.stepped_batch import SteppedPlants

    given = [loaded(scenario) for scenario in scenarios]
    return SteppedPlants(given, motor=motor, output=output, threads=threads)


def _file_for(scenario: AnyScenario, out: str | Path | None) -> str | Path | None:
    """The scenario's file, where results are to be written beside it; None where nothing is.

    Raises:
        InputError: there is none, or the folder cannot be written: better known now than after minutes.
    """
    if out is None:
        return None
    if not isinstance(scenario, str | Path):
        raise InputError(
            "out: what is written extends the scenario's file; give that instead of the scenario"
        )
    from hdsim.tell.staging import staged

    with staged(Path(out), keep=False):
        return scenario


def _records(measured: Measured | Sequence[Measured], mapping: AnyMapping | None) -> list[Record]:
    """Measured records of whatever was given."""
    many = measured if isinstance(measured, list | tuple) else [measured]
    return [_record(one, mapping, k) for k, one in enumerate(many)]


def _record(measured: Any, mapping: AnyMapping | None, number: int) -> Record:
    """One measured record.

    Raises:
        InputError: it is nothing that can be one.
    """
    from hdsim.estimate.records import Record, record_from
    from hdsim.recording import Recording

    if isinstance(measured, Record):
        return measured
    if isinstance(measured, Recording):
        return record_from(measured)
    if isinstance(measured, str | Path):
        from hdsim.log.importing import import_recording

        return record_from(import_recording(measured, mapping), Path(measured).name)
    if hasattr(measured, "columns") and hasattr(measured, "reset_index"):
        from hdsim.log.columns import import_columns

        if mapping is None:
            raise InputError("a data frame needs a mapping: which column is which, and in what unit")
        table = measured.reset_index()  # the time may be its index
        columns = {str(name): table[name].to_numpy() for name in table.columns}
        name = f"frame {number + 1}"
        return record_from(import_columns(columns, mapping, name), name)
    kind = type(measured).__name__
    raise InputError(f"measured: found {kind}, expected a file, a recording or a pandas data frame")


def _plan(
    base: AnyScenario,
    parameters: Mapping[str, Any] | None,
    metrics: str | Sequence[str],
    options: dict[str, Any],
) -> Any:
    """The checked study, from its file or from what was said of it.

    Raises:
        InputError: a scenario without metrics, or the study is wrong.
    """
    from hdsim.nested import copied
    from hdsim.scenario.problems import Mark
    from hdsim.scenario.reader import Source
    from hdsim.scenario.validation import build
    from hdsim.studies.engine.definition import Study
    from hdsim.studies.engine.reading import load_study, plan

    if not metrics:
        if not isinstance(base, str | Path) or parameters or options:
            raise InputError("a study of a scenario needs metrics; hdsim.study(file) runs a study's file")
        return load_study(base)
    scenario = loaded(base)
    varied = {
        name: {"type": "list", "values": copied(given)} if not isinstance(given, Mapping) else copied(given)
        for name, given in (parameters or {}).items()
    }
    data = {
        "name": f"{scenario.name} study"[:200],
        **cast(dict[str, Any], copied(options)),
        "base": {"scenario": copied(scenario)},
        "parameters": varied,
        "metrics": [metrics] if isinstance(metrics, str) else list(metrics),
    }
    source = Source(data, {(): Mark("study")})
    return plan(build(source, Study), source)
