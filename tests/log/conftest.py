"""Recordings to write and read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hdsim.recording import Column, Event, Recording, Table

LONGEST_S = 0.6


@pytest.fixture(scope="session")
def log_of(tmp_path_factory):
    """Makes the log of a scenario's first stretch, once."""
    import hdsim
    from hdsim.scenario.model import Scenario
    from hdsim.simulation.simulate import simulate_to_log

    made: dict[Path, Path] = {}
    folder = tmp_path_factory.mktemp("shipped")

    def make(path: Path) -> Path:
        if path not in made:
            data = hdsim.load_scenario(path).model_dump()
            slow = data["run"]["sample_rate_hz"] < 100
            data["run"]["duration_s"] = min(data["run"]["duration_s"], 60.0 if slow else LONGEST_S)
            made[path] = folder / f"{path.stem}.mcap"
            simulate_to_log(Scenario.model_validate(data), made[path])
        return made[path]

    return make


@pytest.fixture
def recording() -> Recording:
    """Three tables of different rates, one empty, with NaN and infinities, statics, events, metadata."""
    rng = np.random.default_rng(3)
    n = 30_000
    time = np.cumsum(rng.uniform(1e-5, 1e-3, n))
    angle = np.cumsum(rng.standard_normal(n))
    force = rng.standard_normal((300, 200))
    angle[7], angle[8], angle[9] = np.nan, np.inf, -0.0
    force[3, 4] = np.nan
    return Recording(
        {
            "state": Table(
                time,
                {
                    "motor_angle": Column(angle, "rad", "input side"),
                    "output torque": Column(rng.standard_normal(n), "N m", "joint — torque"),
                    "time": Column(rng.standard_normal(n), "s"),
                },
            ),
            "teeth": Table(time[::100], {"normal_force": Column(force, "N", "per tooth")}),
            "empty": Table(np.zeros(0), {"a": Column(np.zeros(0), "m"), "b": Column(np.zeros((0, 5)), "m")}),
        },
        static={
            "gap": Column(rng.standard_normal(200), "m", "half-gap"),
            "map": Column(rng.standard_normal((3, 4)), "rad"),
            "one": Column(np.array(2.5), "1"),
        },
        events=[
            Event(0.1234567890123456, "info", "run", "begins"),
            Event(1 / 3, "warning", "mesh", "gap crossed"),
            Event(0.2, "error", "solver", "späte Nachricht\nin two lines"),
        ],
        metadata={"scenario": "preset: seed-2021\n", "seed": "0", "solver": "Radau, rtol 1e-6"},
    )
