"""The compiled mesh against a plain formula written down again, and its derivatives against differences."""

import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdsim.contact import ValidityWarning, dead_zone
from hdsim.drive import _mesh_layout, _teeth, _teeth_table
from hdsim.drive.model import Model
from hdsim.drive.parameters import Drive
from hdsim.drive.presets import preset_names
from hdsim.effects.mesh_preload import MeshPreload


def teeth_of(mesh: dict[str, Any], preload_arcmin: float = 0.0, **drive: Any) -> Any:
    parts = [MeshPreload(interference_arcmin=preload_arcmin)] if preload_arcmin else []
    model = Model(
        Drive.model_validate({"preset": "seed-2021", "mesh": mesh} | drive), parts, load_inertia_kg_m2=0.5
    )
    assert model.teeth is not None
    return model.teeth


def potential(teeth: Any, x: float, angle: float) -> float:
    """Sum of w U(dead_zone(x + eps, b)) over all teeth, one by one in Python, from the contact law itself.

    With interference (b below zero) it is that of both flanks, U(x + eps - b) + U(-x - eps - b).
    """
    engagement = teeth.mesh.engagement
    depths, weights = np.zeros((2, teeth.count)), np.ones(teeth.count)
    for j in range(teeth.count):
        phi = (2 * np.pi * j / teeth.count + angle + np.pi / 2) % np.pi - np.pi / 2
        gap = teeth.half_gaps_m[j] + teeth.parameters[_mesh_layout.EXTRA_GAP]
        if engagement.kind == "window":
            half, edge = engagement.share * np.pi / 2, engagement.edge_teeth * np.pi / teeth.count
            s = np.clip((half + edge - abs(phi)) / (2 * edge), 0, 1)
            weights[j] = s**3 * (10 - 15 * s + 6 * s**2)
        else:
            gap += teeth.parameters[_mesh_layout.CLEARANCE] * (1 - np.cos(2 * phi)) / 2
        shifted = x + teeth.pitch_errors_m[j]
        if gap >= 0:
            depths[0, j] = abs(dead_zone(shifted, gap))
        else:
            depths[:, j] = np.maximum([shifted - gap, -shifted - gap], 0.0)
    return float(teeth.law.energy(depths).sum(axis=0) @ weights)


@pytest.mark.parametrize("preload_arcmin", [0.0, 0.3])
@pytest.mark.parametrize("kind", ["window", "clearance"])
def test_potential_is_the_sum_over_the_teeth(kind: str, preload_arcmin: float) -> None:
    teeth = teeth_of({"engagement": {"kind": kind}, "pitch_error_m": 5e-7}, preload_arcmin)
    # A preloaded tooth is at the end of the contact's table earlier.
    for x in (-3e-6, -5e-7, 1e-7, 1e-6, 2.5e-6, 3.5e-6 if preload_arcmin else 5e-6):
        for angle in (0.0, 0.3, 2.9, -17.0):
            compiled = _teeth.teeth_potential(teeth.parameters, x, angle)[0]
            assert compiled == pytest.approx(potential(teeth, x, angle), rel=2e-5, abs=1e-12)


MESHES = {
    "window": teeth_of({}),
    "clearance": teeth_of({"engagement": {"kind": "clearance"}}),
    "flank": teeth_of({"gap_along_flank": True, "pitch_error_m": 1e-6}),
    "preload": teeth_of({}, 0.4),
    "preload, smooth": teeth_of(
        {"gap_smoothing_m": 2e-7, "gap_along_flank": True, "engagement": {"kind": "clearance"}}, 0.4
    ),
    "smooth": teeth_of(
        {"gap_smoothing_m": 2e-7, "gap_along_flank": True, "engagement": {"kind": "clearance"}}
    ),
}


@pytest.mark.parametrize("name", MESHES)
@settings(max_examples=60, deadline=None)
@given(x=st.floats(-1e-5, 1e-5), angle=st.floats(-10, 10))
def test_derivatives_are_those_of_the_potential(name: str, x: float, angle: float) -> None:
    parameters = MESHES[name].parameters

    def at(dx: float, da: float) -> Any:
        return np.array(_teeth.teeth_potential(parameters, x + dx, angle + da))

    hx, ha = 1e-10, 1e-6
    here = at(0, 0)
    by_x = (at(hx, 0) - at(-hx, 0)) / (2 * hx)
    by_a = (at(0, ha) - at(0, -ha)) / (2 * ha)
    size = max(abs(here[1]), 1.0)
    assert by_x[0] == pytest.approx(here[1], rel=1e-4, abs=1e-4 * size)
    # At an angle of exactly 0 one tooth is on the border of two cells of its gap: 1.5e-8 of the force.
    assert by_a[0] == pytest.approx(here[3], rel=1e-3, abs=2e-8 * size + 1e-7)
    # A tooth that touches within the difference's step has a kink there: allow for the stiffness of two.
    kink = 2.0 * MESHES[name].law.initial_stiffness_n_per_m
    assert by_x[1] == pytest.approx(here[2], rel=1e-3, abs=kink)
    assert by_a[1] == pytest.approx(here[5], rel=1e-2, abs=2e-2 * size + 5.0)


def test_smooth_dead_zone_is_the_documented_one() -> None:
    from hdsim.contact import smooth_dead_zone

    for x, gap in ((1.4e-6, 1.5e-6), (1.6e-6, 1.5e-6), (5e-7, 1e-7), (1e-5, 1.5e-6)):
        assert _teeth.smooth_depth(x, gap, 2e-7)[0] == pytest.approx(
            float(smooth_dead_zone(x, gap, 2e-7)), rel=1e-12
        )


def test_tooth_forces_add_up_to_the_mesh_force() -> None:
    for teeth in MESHES.values():
        forces, angles = np.zeros(teeth.count), np.zeros(teeth.count)
        _teeth.tooth_forces(teeth.parameters, 8e-6, 1.234, forces, angles)
        assert np.sum(forces) == pytest.approx(
            _teeth.teeth_potential(teeth.parameters, 8e-6, 1.234)[1], rel=1e-12
        )
        assert np.all(np.abs(angles) <= np.pi + 1e-12)


def test_contact_never_pulls() -> None:
    for name, teeth in MESHES.items():
        forces, angles = np.zeros(teeth.count), np.zeros(teeth.count)
        # Pressed between two teeth each is pushed both ways, more by the nearer one.
        for x in (-1e-5, 1e-5, *((-1e-7, 1e-7) if "preload" in name else ())):
            _teeth.tooth_forces(teeth.parameters, x, 0.7, forces, angles)
            assert np.all(np.sign(forces) * np.sign(x) >= 0)


def test_tabulated_mesh_states_an_error_that_holds() -> None:
    exact = MESHES["window"]
    table = teeth_of({"model": "tabulated"})
    assert 0 < table.table_error < 2e-3
    rng = np.random.default_rng(5)
    reach = exact.lever_m * exact.loaded(52.0)[0]
    for x, angle in zip(rng.uniform(-reach, reach, 300), rng.uniform(-5, 5, 300), strict=True):
        torque = _teeth_table.table_potential(table.parameters, x, angle)[1] * table.lever_m
        wanted = _teeth.teeth_potential(exact.parameters, x, angle)[1] * exact.lever_m
        assert abs(torque - wanted) < 1.5 * table.table_error * 52.0


@pytest.mark.parametrize("kind", ["window", "clearance"])
def test_thirty_percent_of_the_teeth_carry_the_rated_torque(kind: str) -> None:
    _, closed = teeth_of({"engagement": {"kind": kind}, "half_gap_m": 0.0}).loaded(52.0)
    assert closed == pytest.approx(0.30, abs=0.02)
    # Of the teeth in the arcs those stay out whose gap the load does not close; a clearance is calibrated.
    _, share = teeth_of({"engagement": {"kind": kind}}).loaded(52.0)
    assert share == pytest.approx({"window": 0.28, "clearance": 0.30}[kind], abs=0.02)


def test_no_preset_reaches_the_forces_at_which_its_contact_law_ends() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", ValidityWarning)
        for name in preset_names():
            Model(Drive.model_validate({"preset": name}), [], load_inertia_kg_m2=0.5)
    # A peak of 11 times the mean tooth force at rated torque that is beyond the bound is told.
    with pytest.warns(ValidityWarning, match="no longer fit on the flank"):
        teeth_of({}, rated_torque_nm=150.0)


def test_clearance_engages_more_teeth_with_more_torque() -> None:
    teeth = MESHES["clearance"]
    shares = [teeth.loaded(torque)[1] for torque in (0.5, 5.0, 25.0, 52.0, 150.0)]
    assert shares == sorted(shares)
    assert shares[0] < 0.2 < 0.4 < shares[-1] + 0.1


def test_compliance_budget_adds_up_to_the_catalogue() -> None:
    chain = MESHES["window"].chain()
    assert sum(chain.values()) == pytest.approx(1.0, abs=1e-12)
    assert all(share >= 0 for share in chain.values())


def test_a_preloaded_mesh_has_no_play_and_carries_load_at_rest() -> None:
    loose, tight = MESHES["window"], MESHES["preload"]
    at_rest = [_teeth.teeth_potential(teeth.parameters, 0.0, 0.3) for teeth in (loose, tight)]
    assert at_rest[0][6] == 0
    assert at_rest[1][6] == pytest.approx(0.30 * tight.count, abs=3)
    # In balance to what the teeth's rounding leaves, with the stiffness of both flanks.
    assert abs(at_rest[1][1]) < 1e-9 * tight.rated_tooth_force_n
    deep = 0.4 * np.pi / 10800 * tight.scale * tight.lever_m - tight.half_gaps_m
    pressed = 2 * 0.30 * tight.count * float(tight.law.stiffness(np.maximum(deep, 0.0)).mean())
    assert at_rest[1][2] == pytest.approx(pressed, rel=0.15)
    # The catalogue's stiffness is that of either drive: what the play takes, the structure gives.
    for teeth in (loose, tight):
        whole = teeth.wind_up(52.0) + float(teeth.structure_wind_up(np.array(52.0)))
        assert whole == pytest.approx(7 / 1.6e4 + 18 / 2.5e4 + 27 / 2.9e4, rel=2e-3)


def test_a_lumped_mesh_knows_a_preload_only_as_less_play() -> None:
    from hdsim.effects.output_backlash import OutputBacklash

    drive = Drive.model_validate({"preset": "seed-2021", "mesh": {"model": "lumped"}})
    arcmin = np.pi / 10800
    for preload, half_gap in ((0.1, 0.1), (0.2, 0.0), (0.6, 0.0)):
        parts = [OutputBacklash(backlash_arcmin=0.4), MeshPreload(interference_arcmin=preload)]
        kernel, numbers = Model(drive, parts, load_inertia_kg_m2=0.5)._mesh_parameters()
        assert kernel is not None
        for twist in (-0.3, -0.05, 0.05, 0.3):
            result = np.zeros(_mesh_layout.RESULT_SIZE)
            kernel.function(np.array([0.0, 0.0, -twist * arcmin]), np.zeros(6), numbers, result)
            past = np.sign(twist) * max(abs(twist) - half_gap, 0.0) * arcmin
            wanted = drive.torsion.stiffness_k1_nm_per_rad * past
            assert -result[_mesh_layout.GRADIENT + 2] == pytest.approx(wanted, rel=1e-9)


def test_the_widest_edge_shares_the_load_as_an_elliptical_flexspline() -> None:
    """cos^2 over 45 degrees each side: half of the peak on average, a quarter of the teeth by weight."""
    teeth = teeth_of({"half_gap_m": 0.0, "engagement": {"share": 0.25, "edge_teeth": 25.0}})
    forces, angles = np.zeros(teeth.count), np.zeros(teeth.count)
    _teeth.tooth_forces(teeth.parameters, teeth.lever_m * teeth.loaded(52.0)[0], 0.3, forces, angles)
    from_axis = np.abs((angles + np.pi / 2) % np.pi - np.pi / 2)
    bell = np.where(from_axis < np.pi / 4, np.cos(2 * from_axis) ** 2, 0.0)
    peak = forces.max()
    assert forces == pytest.approx(peak * bell, abs=0.05 * peak)
    assert forces[bell > 0].mean() == pytest.approx(0.5 * peak, rel=0.02)
    assert forces.sum() == pytest.approx(52.0 / teeth.lever_m, rel=1e-3)
