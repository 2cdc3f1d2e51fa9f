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


def test_a_play_that_is_taken_up_at_once_is_the_gap(tmp_path: Path) -> None:
    # Two formulations of one thing: a spring in series that gives way at once, and a wider gap of the mesh.
    torques = []
    for play in ("{backlash_arcmin: 3}", "{backlash_arcmin: 3, coefficient_per_nm: 2000}"):
        path = tmp_path / "locked.yaml"
        path.write_text(
            "drive: {preset: csg-20-100, mesh: {model: lumped}}\n"
            "command:\n"
            "  motor: {type: motion, trajectory: {type: sine, amplitude_deg: 12, frequency_hz: 0.5}}\n"
            "  output: {type: locked}\n"
            "load: {inertia_kg_m2: 0.1}\n"
            f"effects: {{output_backlash: {play}}}\n"
            "run: {duration_s: 2.0, sample_rate_hz: 200}\n",
            encoding="utf-8",
        )
        torques.append(hdsim.simulate(hdsim.load_scenario(path))["output_torque"])
    assert np.ptp(torques[0]) > 20
    assert np.mean(np.abs(torques[0]) < 0.1) > 0.1  # the play
    np.testing.assert_allclose(torques[1], torques[0], atol=2e-3 * np.max(np.abs(torques[0])))


def test_a_hysteresis_loop_closes_under_a_bias(tmp_path: Path) -> None:
    """490 cycles of 7 to 13 N m: ideal elements lose nothing after the first, these 1/sharpness at most."""
    path = tmp_path / "bias.yaml"
    path.write_text(
        "drive: {preset: csg-20-100, mesh: {model: lumped}}\n"
        "command: {motor: {type: motion, trajectory: {type: hold, angle_deg: 0}}}\n"
        "load:\n"
        "  inertia_kg_m2: 0.05\n"
        "  torque: {type: sine, amplitude_nm: 3, offset_nm: 10, frequency_hz: 5}\n"
        "effects: {torsional_hysteresis_maxwell: {}}\n"
        "run: {duration_s: 98, sample_rate_hz: 200}\n",
        encoding="utf-8",
    )
    scenario = hdsim.load_scenario(path)
    found = hdsim.simulate(scenario)
    effect = scenario.effects.active()["torsional_hysteresis_maxwell"]

    def cycles(channel: str) -> np.ndarray:
        """Mean of each cycle once the start has died away."""
        return found[channel][:-1].reshape(-1, 40).mean(axis=1)[5:]

    drift = cycles("output_angle")[-1] - cycles("output_angle")[0]
    assert abs(np.degrees(drift)) * 3600 < 0.05
    assert np.ptp(found["output_angle"]) > 1e-4
    for k, element in enumerate(effect.slip_elements(), 1):
        torque = cycles(f"slip_element_{k}_torque")
        assert abs(torque[-1] - torque[0]) < element.slip_torque_nm / effect.sharpness
