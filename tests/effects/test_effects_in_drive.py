"""All effects in a real drive at once: the assembled model keeps its energy account."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import hdsim
from hdsim.effects import catalogue

ROOT = Path(__file__).parents[2]


def test_energy_audit_closes_with_every_effect_on(tmp_path: Path) -> None:
    scenario = tmp_path / "everything.yaml"
    effects = "\n".join(f"  {name}: {{}}" for name in catalogue())
    scenario.write_text(
        f"extends: {(ROOT / 'scenarios' / 'sine_tracking.yaml').as_posix()}\n"
        f"effects:\n{effects}\nrun:\n  duration_s: 0.15\n",
        encoding="utf-8",
    )
    recording = hdsim.simulate(hdsim.load_scenario(scenario))
    exchanged = np.ptp(recording["work_supplied"]) + np.ptp(recording["heat"])
    assert np.abs(recording["energy_residual"]).max() < 1e-6 * exchanged
    assert np.all(np.diff(recording["heat"]) > -1e-9 * recording["heat"][-1])
    assert recording["temperature"][-1] > recording["temperature"][0]
    assert np.ptp(recording["bristle_deflection"]) > 0
