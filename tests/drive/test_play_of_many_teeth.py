"""The play of many teeth: against teeth that are summed one by one, and as one potential."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from test_jacobian import check

import hdsim
from hdsim.effects.output_backlash import OutputBacklash
from hdsim.errors import InputError
from hdsim.scenario import Scenario
from hdsim.simulation.setup import build_model, build_run

ARCMIN = math.radians(1 / 60)
STIFFNESS, PLAY, SPREAD = 2e4, 1.2, 0.6  # N m/rad, arcmin, 1
#: All teeth bear where the widest gap is taken up: K (g_1 - g_0) / 2 for evenly spread gaps.
UPTAKE = STIFFNESS * SPREAD * 0.5 * PLAY * ARCMIN
WAVES = [
    {"order": 2, "amplitude_arcmin": 0.11, "phase_deg": 40.0},
    {"order": 4, "amplitude_arcmin": 0.05, "phase_deg": -100.0, "per": "wave_generator_turn"},
]


#: The output held, the motor turned to and fro.
TWISTED = {
    "command": {
        "motor": {
            "type": "motion",
            "trajectory": {"type": "sine", "amplitude_deg": 12, "frequency_hz": 0.5},
        },
        "output": {"type": "locked"},
    },
    "load": {"inertia_kg_m2": 0.1},
    "run": {"duration_s": 2.0, "sample_rate_hz": 200},
}


def around(motor: np.ndarray, components: list[dict[str, Any]]) -> np.ndarray:
    """What components add to the half-gap at the motor's angles, the output held, rad."""
    waves = [
        c["amplitude_arcmin"] * ARCMIN * np.sin(c["order"] * motor + math.radians(c["phase_deg"]))
        for c in components
    ]
    return np.sum([np.zeros_like(motor), *waves], axis=0)


def scenario(effect: dict[str, Any], **sections: Any) -> Scenario:
    torsion = {f"stiffness_k{k}_nm_per_rad": STIFFNESS for k in (1, 2, 3)} | {"damping_nm_s_per_rad": 0.0}
    return Scenario.model_validate(
        {
            "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}, "torsion": torsion},
            "effects": {"output_backlash": effect},
        }
        | sections
    )


@pytest.mark.parametrize("components", [[], WAVES], ids=["alike", "around"])
def test_it_is_the_sum_of_teeth_whose_gaps_differ(components: list[dict[str, Any]]) -> None:
    effect = {
        "backlash_arcmin": PLAY, "gap_spread": SPREAD, "uptake_torque_nm": UPTAKE, "components": components
    }  # fmt: skip
    run = build_run(scenario(effect, **TWISTED)).record()
    motor = np.asarray(run["motor_angle"])
    twist = motor / -100.0
    teeth = 4000
    gaps = 0.5 * PLAY * ARCMIN * (1 + SPREAD * (2 * (np.arange(teeth) + 0.5) / teeth - 1))
    past = np.maximum(np.abs(twist)[:, None] - (gaps + around(motor, components)[:, None]), 0.0)
    expected = np.sign(twist) * STIFFNESS * past.mean(axis=1)
    assert np.ptp(expected) > 30
    assert np.count_nonzero(expected == 0.0) > 5
    np.testing.assert_allclose(run["output_torque"], expected, atol=2e-4 * np.max(np.abs(expected)))


def test_a_preload_takes_up_what_goes_round() -> None:
    effects = {
        "output_backlash": {"backlash_arcmin": 0.0, "components": WAVES},
        "mesh_preload": {"interference_arcmin": 0.01},
    }
    run = build_run(scenario({}, effects=effects, **TWISTED)).record()
    motor = np.asarray(run["motor_angle"])
    gap = np.maximum(around(motor, WAVES) - 0.01 * ARCMIN, 0.0)
    assert 0.1 < np.mean(gap > 0) < 0.9
    expected = np.sign(motor / -100.0) * STIFFNESS * np.maximum(np.abs(motor / 100.0) - gap, 0.0)
    np.testing.assert_allclose(run["output_torque"], expected, atol=2e-4 * np.max(np.abs(expected)))


def test_play_that_goes_round_makes_no_energy() -> None:
    run = build_run(
        Scenario.model_validate(
            {
                "drive": {
                    "preset": "csg-20-100",
                    "mesh": {"model": "lumped"},
                    "torsion": {"damping_nm_s_per_rad": 0.0},
                    "friction": {"coulomb_nm": 0.0, "viscous_nm_s_per_rad": 0.0, "load_coefficient": 0.0},
                },
                "effects": {
                    "output_backlash": {
                        "backlash_arcmin": 4, "gap_spread": 0.5, "uptake_torque_nm": 2.0,
                        "components": [c | {"amplitude_arcmin": 0.4} for c in WAVES],
                    }
                },
                "command": {"motor": {"type": "free"}},
                "load": {"inertia_kg_m2": 0.3, "gravity": {"mass_kg": 4, "centre_of_mass_m": 0.3}},
                "run": {
                    "duration_s": 1.0, "sample_rate_hz": 2000, "start": {"motor_velocity_rad_per_s": 30.0},
                    "rtol": 1e-9, "atol": 1e-12,
                },
            }
        )
    ).record()  # fmt: skip
    twist = np.asarray(run["motor_angle"]) / -100.0 - np.asarray(run["output_angle"])
    assert np.count_nonzero(np.diff(np.sign(twist))) > 4  # from flank to flank
    assert np.max(np.abs(run["energy_residual"])) < 1e-6 * np.ptp(run["potential_energy"])


@pytest.mark.parametrize("backlash_arcmin", [4.0, 0.1])
def test_its_jacobian_is_exact(backlash_arcmin: float) -> None:
    effect = {
        "backlash_arcmin": backlash_arcmin, "components": [c | {"amplitude_arcmin": 0.4} for c in WAVES]
    }  # fmt: skip
    given = {
        "load": {"inertia_kg_m2": 0.3},
        "run": {"duration_s": 1.0},
        "command": {"motor": {"type": "free"}},
    }
    check(build_model(scenario(effect, **given)).system)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"gap_spread": 0.4}, "uptake_torque_nm"),
        ({"gap_spread": 0.4, "uptake_torque_nm": 1.0, "coefficient_per_nm": 2.0}, "coefficient_per_nm"),
        ({"gap_spread": 1.5, "uptake_torque_nm": 1.0}, "gap_spread"),
    ],
)
def test_a_spread_needs_the_torque_of_its_last_tooth(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        OutputBacklash.model_validate(given)


def test_teeth_have_their_own_gaps(tmp_path: Any) -> None:
    path = tmp_path / "teeth.yaml"
    path.write_text(
        "drive: {preset: seed-2021}\neffects: {output_backlash: {components: [{order: 2}]}}\n"
        "command: {motor: {type: free}}\nload: {inertia_kg_m2: 1}\nrun: {duration_s: 0.1}\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="gaps of their own"):
        hdsim.simulate(hdsim.load_scenario(path))
