"""Numbers of teeth, flanks and contact: asked for, they are found again where the data tell them."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import hdsim
from hdsim.estimate.estimation import Estimation
from hdsim.estimate.numbers import base_freedoms, undeclared
from hdsim.estimate.records import Record
from hdsim.estimate.state import state_of
from hdsim.scenario import Scenario

MESH = "drive.mesh"
FLANKS = f"{MESH}.flanks"
#: Each number with the factor by which the plant's differs, and what the mesh has beside the preset's.
NUMBERS: dict[str, tuple[float, dict[str, Any]]] = {
    f"{FLANKS}.circular_spline.fractal_dimension": (1.03, {}),
    f"{FLANKS}.flexspline.fractal_roughness_m": (3.0, {}),
    # The softer of the two yields.
    f"{MESH}.contact.materials.flexspline.hardness_pa": (
        0.8,
        {
            "contact": {
                "law": "majumdar_bhushan",
                "materials": {
                    "circular_spline": {
                        "hardness_pa": 5e9,
                        "youngs_modulus_pa": 2.12e11,
                        "poisson_ratio": 0.28,
                    }
                },
            }
        },
    ),
    f"{MESH}.contact.contact_stiffness_n_per_m": (
        1.6,
        {"contact": {"law": "constant", "contact_stiffness_n_per_m": 3e8}},
    ),
    f"{MESH}.gap_factor": (1.8, {}),
    f"{MESH}.half_gap_m": (0.6, {"half_gap_m": 1e-6}),
    f"{MESH}.engagement.share": (0.8, {}),
    f"{MESH}.engagement.edge_teeth": (0.6, {}),
    f"{MESH}.engagement.clearance_m": (1.4, {"engagement": {"kind": "clearance", "clearance_m": 5e-6}}),
    f"{MESH}.pitch_error_m": (1.6, {"pitch_error_m": 5e-7}),
    f"{MESH}.tooth_bending_stiffness_n_per_m": (1.5, {}),
}
#: Those that only an encoder nearly without noise tells, as the catalogue's stiffness hides them; one that
#: only flanks that are known tell.
HIDDEN = (f"{MESH}.contact.materials.flexspline.hardness_pa", f"{MESH}.contact.contact_stiffness_n_per_m")
UNTOLD = f"{MESH}.engagement.edge_teeth"
#: Fits of these take longest.
LONGEST = ("clearance_m", "gap_factor", "fractal_roughness_m", "tooth_bending_stiffness_n_per_m")


def scenario(mesh: dict[str, Any]) -> Scenario:
    # Each tooth that enters by its clearance is a corner to the solver, thirty times as dear as a window.
    seconds = 1.6 if mesh.get("engagement", {}).get("kind") == "clearance" else 3.6
    return Scenario.model_validate(
        {
            "drive": {
                "preset": "seed-2021",
                "mesh": {"model": "tabulated", "ring": "static"} | mesh,
                "torsion": {"damping_nm_s_per_rad": 40.0},
            },
            "command": {
                "motor": {
                    "type": "motion",
                    "trajectory": {"type": "sine", "amplitude_deg": 800, "frequency_hz": 0.5},
                }
            },
            "load": {
                "inertia_kg_m2": 0.5,
                "torque": {"type": "sine", "amplitude_nm": 45, "frequency_hz": 1.3},
            },
            "run": {"duration_s": seconds, "sample_rate_hz": 250, "teeth_rate_hz": 0, "seed": 4},
        }
    )


def record(plant: Scenario, times: float = 1.0, seed: int = 0) -> Record:
    run, rng = hdsim.simulate(plant), np.random.default_rng(seed)
    noise = {"motor_angle": 1e-6, "output_angle": 1e-7, "motor_torque": 2e-3, "load_torque": 1e-3}
    late = run.time >= 0.6 - 1e-9  # after the start's ringing
    time = run.time[late] - 0.6
    return Record(
        "r", time, {c: run[c][late] + times * s * rng.standard_normal(len(time)) for c, s in noise.items()}
    )


def fitted(
    paths: list[str], changes: dict[str, float], mesh: dict[str, Any], times: float = 1.0
) -> Estimation:
    base = scenario(mesh)
    state = state_of(base)
    values = {path: undeclared(state, path, 0.0).value * factor for path, factor in changes.items()}  # type: ignore[union-attr]
    # The plant sums its teeth, as a fit does those that it moves: a table is off by more than this noise.
    plant = scenario({"model": "teeth"} | mesh).with_(values)
    return hdsim.fit([record(plant, times)], base, free=paths, load="load_torque")


@cache
def alone(path: str) -> Estimation:
    """Of a plant that has the base's own flanks and engagement, and an interval that counts no other ones."""
    factor, mesh = NUMBERS[path]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hdsim.estimate.refit.widen_by_flanks", lambda bench, found: None)
        return fitted([path], {path: factor}, mesh, 0.02 if path in HIDDEN else 1.0)


@pytest.mark.parametrize("path", NUMBERS)
def test_no_fit_moves_it_unasked_and_its_field_says_what_is_believed(path: str) -> None:
    _, mesh = NUMBERS[path]
    state = state_of(scenario(mesh))
    names = [free.name for free in base_freedoms(state, ["motor_torque", "output_angle"])]
    assert names
    assert not any(name.startswith(MESH) for name in names)
    free = undeclared(state, path, math.nan)
    assert free is not None
    assert 0.04 < free.prior < 2.0
    assert free.far > 1.1


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=pytest.mark.study) if path.endswith(LONGEST) else path
        for path in NUMBERS
        if path != UNTOLD
    ],
)
def test_a_changed_one_is_found_again(path: str) -> None:
    factor, _ = NUMBERS[path]
    (found,) = alone(path).intervals
    true = found.start * factor
    assert found.determined
    assert found.moved
    assert found.value == pytest.approx(true, rel=0.02) or found.low <= true <= found.high
    gap = alone(path).gap["output_angle"]
    assert gap.after < 0.7 * gap.before, "the prediction moves with it, towards the data"


@pytest.mark.slow
@pytest.mark.study
def test_one_that_other_flanks_move_as_far_is_said_not_to_be_determined() -> None:
    (own,) = alone(UNTOLD).intervals
    assert own.determined, "where the flanks are known"
    factor, mesh = NUMBERS[UNTOLD]
    (found,) = fitted([UNTOLD], {UNTOLD: factor}, mesh).intervals
    assert not found.determined
    assert math.isnan(found.low)


@pytest.mark.slow
def test_dimension_and_roughness_are_seen_as_one_height() -> None:
    # Heights go with G^(D - 2): a rougher flank of lower dimension has the same gap. With a usual encoder.
    paths = [f"{MESH}.flanks.{one}.{what}" for one in ("flexspline", "circular_spline")
             for what in ("fractal_dimension", "fractal_roughness_m")]  # fmt: skip
    found = fitted(paths, {paths[1]: 3.0}, {}, 30.0)
    assert sum(interval.determined for interval in found.intervals) < len(paths)
    tied = [interval for interval in found.intervals if not interval.determined or interval.tied_to]
    assert tied
    seen = [one for one in found.directions if one.seen]
    unseen = [one for one in found.directions if not one.seen]
    assert seen
    assert unseen, "some combination of the four is not told"
    assert set(seen[0].parts) & set(paths)
