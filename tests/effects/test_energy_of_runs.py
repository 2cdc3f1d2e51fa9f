"""1,000 whole runs with random effects of usual and unusual size: the energy account closes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError

import hdsim.drive.model as drive_model
from hdsim.drive.parameters import Drive
from hdsim.effects import catalogue
from hdsim.effects._plausible import range_of, scales_of
from hdsim.simulation.run import Run

#: Factor by which numbers are drawn beyond where they usually lie, within what is legal.
BEYOND = 3.0
#: A table is what was measured: where it drives it supplies. Sensors have no power.
DRAWN = [name for name in catalogue() if name not in ("table", "sensors")]


def sized(
    kind: type[BaseModel], data: Any, path: str, scales: dict[str, float], rng: np.random.Generator
) -> Any:
    """An effect's fields with random numbers where it says where they usually lie."""
    if isinstance(data, dict):
        return {
            key: sized(kind, value, f"{path}.{key}" if path else key, scales, rng)
            for key, value in data.items()
        }
    if isinstance(data, list | tuple):
        return [sized(kind, value, f"{path}.{k}", scales, rng) for k, value in enumerate(data)]
    known = range_of(kind, path)
    if known.plausible is None or (data is None and rng.random() < 0.5):
        return data
    low, high = known.plausible.times(scales)
    if low < 0:  # an exponent
        return float(rng.uniform(max(low * BEYOND, known.least), min(high * BEYOND, known.most)))
    low, high = max(low / BEYOND, known.least), min(high * BEYOND, 0.999 * known.most)
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def drawn(name: str, scales: dict[str, float], rng: np.random.Generator) -> Any:
    """An effect with random numbers."""
    kind = catalogue()[name]
    while True:
        try:
            return kind.model_validate(sized(kind, kind().model_dump(), "", scales, rng))
        except ValidationError:
            continue  # two ways of saying one number


def run_of(seed: int, rtol: float = 1e-9) -> Run:
    """A motor let go at speed on a drive with two to six effects and a load."""
    rng = np.random.default_rng([17, seed])
    drive = Drive.model_validate({"preset": "csg-20-100", "mesh": {"model": "lumped"}})
    torsion = drive.torsion
    scales = scales_of(drive.rated_torque_nm, drive.ratio, torsion.stiffness_k1_nm_per_rad)
    names = rng.choice(DRAWN, int(rng.integers(2, 7)), replace=False)
    model = drive_model.Model(
        drive,
        [drawn(str(name), scales, rng) for name in names],
        load_inertia_kg_m2=float(np.exp(rng.uniform(np.log(0.01), np.log(5.0)))),
    )
    speed = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(1.0), np.log(300.0))))
    y0 = model.initial_state(motor_velocity=speed)
    return Run(model, duration_s=0.1, sample_rate_hz=500.0, rtol=rtol, y0=y0)


@pytest.mark.parametrize("block", range(10))
def test_the_energy_of_a_thousand_runs_closes_and_no_part_gives_heat_back(block: int) -> None:
    for seed in range(100 * block, 100 * block + 100):
        run = run_of(seed)
        run.record()
        names = [type(part).__name__ for part in run.model.parts]
        assert run.audit.given_back <= 1e-12 * run.audit.exchanged, names
        if run.audit.relative >= 1e-6:
            # A step across a play's corner errs by 1e4 times the tolerance and falls with it: no leak does.
            run = run_of(seed, rtol=1e-12)
            run.record()
            assert run.audit.relative < 1e-8, names
