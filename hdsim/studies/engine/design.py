"""The runs of a study: stated values times samples times replicates, each run with its seed."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdsim.errors import InputError
from hdsim.studies.engine.definition import (
    Distribution,
    Grid,
    LatinHypercube,
    LogNormal,
    LogUniform,
    Morris,
    Normal,
    RandomSampling,
    SobolIndices,
    SobolSequence,
    Study,
    Triangular,
    Uniform,
    ValueList,
)

Array = NDArray[np.float64]
#: Random stream of a study's samples, beside those of its drives.
_SAMPLES = 1


@dataclass(frozen=True)
class RunPoint:
    """One run of a study.

    Args:
        index: place in the study, from 0.
        point: which combination of stated values, from 0.
        sample: which sample of the distributions, from 0.
        replicate: which drive at that point, from 0.
        seed: the run's seed.
        values: the parameters' values, in the study's order.
    """

    index: int
    point: int
    sample: int
    replicate: int
    seed: int
    values: tuple[Any, ...]


def runs(study: Study, own_seed: int = 0) -> list[RunPoint]:
    """All runs of a study.

    The design is the Cartesian product, slowest first: stated values (the first parameter slowest), samples
    of all distributions, replicates. Every combination of stated values meets the same samples.

    Args:
        study: the study.
        own_seed: seed of the base scenario, which the study's first drive has.
    """
    names = list(study.parameters)
    factors = {name: factor_values(variation) for name, variation in study.factors.items()}
    samples = sampled(study)
    found: list[RunPoint] = []
    for point, chosen in enumerate(itertools.product(*factors.values())):
        stated = dict(zip(factors, chosen, strict=True))
        for sample, row in enumerate(samples):
            drawn = dict(zip(study.distributions, map(float, row), strict=True))
            values = tuple((stated | drawn)[name] for name in names)
            for replicate in range(study.replicates):
                index = len(found)
                drive = {
                    "common": replicate,
                    "population": sample * study.replicates + replicate,
                    "independent": index,
                }[study.drives]
                seed = drive_seed(own_seed, study.seed, drive)
                found.append(RunPoint(index, point, sample, replicate, seed, values))
    return found


def drive_seed(own_seed: int, study_seed: int, drive: int) -> int:
    """Seed of a drive: drive 0 is the base scenario's own, the others follow from the study's seed.

    Args:
        own_seed: seed of the base scenario.
        study_seed: the study's.
        drive: number of the drive.
    """
    if drive == 0:
        return own_seed
    words = np.random.SeedSequence(study_seed, spawn_key=(drive,)).generate_state(1, np.uint64)
    return int(words[0] >> np.uint64(1))


def factor_values(variation: ValueList | Grid) -> list[Any]:
    """The values of a parameter with stated values."""
    if isinstance(variation, ValueList):
        return list(variation.values)
    space = np.linspace if variation.spacing == "linear" else np.geomspace
    return [float(x) for x in space(variation.start, variation.stop, variation.points)]


def quantile(distribution: Distribution, share: Array) -> Array:
    """Quantile function of a distribution; ``share`` between 0 and 1."""
    from scipy import stats

    d = distribution
    match d:
        case Uniform():
            frozen = stats.uniform(d.low, d.high - d.low)
        case LogUniform():
            frozen = stats.loguniform(d.low, d.high)
        case Triangular():
            frozen = stats.triang((d.mode - d.low) / (d.high - d.low), d.low, d.high - d.low)
        case LogNormal():
            frozen = stats.lognorm(np.log(d.geometric_standard_deviation), scale=d.median)
        case Normal():
            sd = d.standard_deviation
            frozen = stats.truncnorm((d.low - d.mean) / sd, (d.high - d.mean) / sd, d.mean, sd)
    return np.asarray(frozen.ppf(share))


def sampled(study: Study) -> Array:
    """Values of the distributions, shape (samples, distributions); one empty row without distributions."""
    count = len(study.distributions)
    if study.sampling is None:
        return np.zeros((1, 0))
    unit = unit_samples(study)
    columns = [quantile(d, unit[:, k]) for k, d in enumerate(study.distributions.values())]
    return np.stack(columns, axis=1).reshape(-1, count)


def unit_samples(study: Study) -> Array:
    """Samples in the unit cube, shape (samples, distributions)."""
    count = len(study.distributions)
    rng = np.random.default_rng(np.random.SeedSequence([study.seed, _SAMPLES]))
    match study.sampling:
        case RandomSampling(samples=samples):
            return rng.random((samples, count))
        case LatinHypercube(samples=samples):
            from scipy.stats import qmc

            return np.asarray(qmc.LatinHypercube(count, rng=rng).random(samples))
        case SobolSequence(samples=samples):
            from scipy.stats import qmc

            # The sequence itself is drawn as whole powers of two; a part of it is allowed, if less balanced.
            power = max(0, (samples - 1).bit_length())
            return np.asarray(qmc.Sobol(count, rng=rng).random_base2(power)[:samples])
        case SobolIndices() | Morris():
            from hdsim.studies.engine.sensitivity import unit_design

            # An end of the cube is no quantile of a distribution without ends.
            return np.clip(unit_design(study), 5e-4, 1 - 5e-4)
    raise InputError("the study has no sampling")
