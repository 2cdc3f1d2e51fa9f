"""Global sensitivity with SALib: which tolerance costs how much of a metric.

Sobol's indices split the variance of a metric over the parameters (Saltelli et al. 2010, Computer Physics
Communications 181:259; Jansen's estimator of the total index as SALib has it). Morris's elementary effects
screen many parameters with few runs (Morris 1991, Technometrics 33:161; Campolongo et al. 2007).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.studies.engine.definition import Morris, SobolIndices, Study

if TYPE_CHECKING:
    from hdsim.studies.engine.reading import Plan
    from hdsim.studies.engine.table import StudyTable

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensitivity:
    """How much of a metric a parameter costs.

    Args:
        metric: name of the metric.
        unit: its unit.
        parameter: name of the parameter.
        cost: in the metric's unit. Sobol: standard deviation that goes if the parameter were known,
            sqrt(S_T var). Morris: mean size of the elementary effect over the whole range, mu*.
        first: Sobol: first-order index S_1; Morris: standard deviation of the effects (interactions,
        curvature).
        total: Sobol: total index S_T; Morris: mean of the effects with their sign.
        uncertainty: half-width of the confidence interval of ``total`` (Sobol) or ``cost`` (Morris).
    """

    metric: str
    unit: str
    parameter: str
    cost: float
    first: float
    total: float
    uncertainty: float


def is_sensitivity(study: Study) -> bool:
    """Whether a study's sampling is made for indices."""
    return isinstance(study.sampling, SobolIndices | Morris)


def _salib() -> None:
    try:
        import SALib  # noqa: F401
    except ImportError:
        raise InputError("sensitivity indices need SALib: pip install 'hdsim[sensitivity]'") from None


def _problem(study: Study) -> dict[str, Any]:
    names = list(study.distributions)
    return {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}


def unit_design(study: Study) -> Array:
    """SALib's samples in the unit cube, shape (runs, parameters)."""
    _salib()
    match study.sampling:
        case SobolIndices(base_samples=samples):
            from SALib.sample import sobol

            found = sobol.sample(_problem(study), samples, calc_second_order=False, seed=study.seed)
        case Morris(trajectories=trajectories, levels=levels):
            from SALib.sample import morris

            found = morris.sample(_problem(study), trajectories, num_levels=levels, seed=study.seed)
        case _:
            raise InputError("the study's sampling is not made for sensitivity indices")
    return np.asarray(found)


def indices(plan: Plan, table: StudyTable) -> list[Sensitivity]:
    """Indices of every metric, replicates averaged.

    Raises:
        InputError: a run failed: the estimators need every run.
    """
    _salib()
    study = plan.study
    found: list[Sensitivity] = []
    points = unit_design(study)
    for metric in plan.metrics:
        values = table.values(metric.name).reshape(len(points), study.replicates).mean(axis=1)
        missing = int(np.count_nonzero(~np.isfinite(values)))
        if missing:
            raise InputError(
                f"{metric.name}: {missing} of {len(values)} samples have a failed run (column reason); "
                f"sensitivity indices need them all: narrow the distributions"
            )
        found += _of_metric(study, metric.name, metric.unit, points, values)
    return found


def _of_metric(study: Study, metric: str, unit: str, points: Array, values: Array) -> list[Sensitivity]:
    problem = _problem(study)
    spread = float(np.std(values))
    if spread == 0.0:
        return [Sensitivity(metric, unit, name, 0.0, 0.0, 0.0, 0.0) for name in problem["names"]]
    if isinstance(study.sampling, SobolIndices):
        from SALib.analyze import sobol

        r = sobol.analyze(
            problem,
            values,
            calc_second_order=False,
            conf_level=study.confidence,
            print_to_console=False,
            seed=study.seed,
        )
        return [
            Sensitivity(
                metric, unit, name, spread * float(np.sqrt(max(0.0, r["ST"][k]))),
                float(r["S1"][k]), float(r["ST"][k]), float(r["ST_conf"][k]),
            )
            for k, name in enumerate(problem["names"])
        ]  # fmt: skip
    from SALib.analyze import morris

    assert isinstance(study.sampling, Morris)
    r = morris.analyze(
        problem,
        points,
        values,
        num_levels=study.sampling.levels,
        conf_level=study.confidence,
        print_to_console=False,
        seed=study.seed,
    )
    return [
        Sensitivity(
            metric, unit, name, float(r["mu_star"][k]), float(r["sigma"][k]), float(r["mu"][k]),
            float(r["mu_star_conf"][k]),
        )
        for k, name in enumerate(problem["names"])
    ]  # fmt: skip


def write_indices(found: list[Sensitivity], path: Path) -> Path:
    """Write indices as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["metric", "unit", "parameter", "cost", "first", "total", "uncertainty"])
        for s in found:
            writer.writerow([s.metric, s.unit, s.parameter, s.cost, s.first, s.total, s.uncertainty])
    return path
