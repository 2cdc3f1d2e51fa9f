"""A tooth that differs: its potential written down again, where it passes, runs that keep their energy."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import hdsim
from hdsim.contact import dead_zone
from hdsim.drive import _odd_tooth, _teeth
from hdsim.drive.model import Model
from hdsim.drive.parameters import Drive
from hdsim.effects.tooth_error import ToothError

SHIFT, WIDENED = 3e-6, 1.5e-6


def teeth_of(
    mesh: dict[str, Any], errors: list[ToothError], arrangement: str = "circular_spline_fixed"
) -> Any:
    drive = Drive.model_validate({"preset": "seed-2021", "mesh": mesh, "arrangement": arrangement})
    teeth = Model(drive, errors, load_inertia_kg_m2=0.5).teeth
    assert teeth is not None
    return teeth


def added(teeth: Any, x: float, angles: Any) -> np.ndarray:
    """What the odd teeth add to potential and derivatives."""
    return np.array(_odd_tooth.odd_potential(teeth.parameters, x, np.array(angles, dtype=float), (0.0,) * 7))


def pair_energy(teeth: Any, tooth: int, x: float, angle: float, shift: float, widened: float) -> float:
    """Energy of one pair from the contact law, its engagement written down again."""
    phi = (2 * np.pi * tooth / teeth.count + angle + np.pi / 2) % np.pi - np.pi / 2
    gap, weight = teeth.half_gaps_m[tooth] + widened, 1.0
    if teeth.mesh.engagement.kind == "window":
        half, edge = teeth.mesh.engagement.share * np.pi / 2, 8.0 * np.pi / teeth.count
        s = np.clip((half + edge - abs(phi)) / (2 * edge), 0, 1)
        weight = s**3 * (10 - 15 * s + 6 * s**2)
    else:
        from hdsim.drive import _mesh_layout

        gap += teeth.parameters[_mesh_layout.CLEARANCE] * (1 - np.cos(2 * phi)) / 2
    x += teeth.pitch_errors_m[tooth] + shift
    depths = [abs(dead_zone(x, gap))] if gap >= 0 else [max(x - gap, 0.0), max(-x - gap, 0.0)]
    return float(weight * sum(teeth.law.energy(np.array(depths))))


@pytest.mark.parametrize("kind", ["window", "clearance"])
@pytest.mark.parametrize("widened", [WIDENED, -WIDENED])
def test_a_tooth_between_two_gives_each_its_share(kind: str, widened: float) -> None:
    error = ToothError(tooth=57.25, shift_um=1e6 * SHIFT, widened_um=1e6 * widened)
    teeth = teeth_of({"engagement": {"kind": kind}, "pitch_error_m": 5e-7}, [error])
    for x in (-5e-6, -1e-7, 2e-6):
        for angle in (-1.8, -1.6, 0.9, 11.0):
            wanted = sum(
                part
                * (
                    pair_energy(teeth, tooth, x, angle, SHIFT, widened)
                    - pair_energy(teeth, tooth, x, angle, 0.0, 0.0)
                )
                for tooth, part in ((57, 0.75), (58, 0.25))
            )
            assert added(teeth, x, [-angle, 0.0, 0.0])[0] == pytest.approx(wanted, rel=2e-4, abs=1e-10)


@pytest.mark.parametrize("member", ["flexspline", "circular_spline"])
@pytest.mark.parametrize(
    "mesh",
    [{}, {"engagement": {"kind": "clearance"}, "gap_along_flank": True}, {"gap_smoothing_m": 2e-7}],
    ids=["window", "clearance", "smooth"],
)
def test_derivatives_are_those_of_the_odd_potential(member: str, mesh: dict[str, Any]) -> None:
    teeth = teeth_of(mesh, [ToothError(member=member, tooth=12.4, shift_um=8.0, widened_um=-1.0)])
    rng = np.random.default_rng(3)
    scale = max(abs(added(teeth, 2e-6, [a, 0.0, 0.0])[1]) for a in np.linspace(0, 3, 50))
    for _ in range(60):
        x, motor = rng.uniform(-6e-6, 6e-6), rng.uniform(-9, 9)
        ring = -motor / 100

        def at(dx: float, da: float, x: float = x, motor: float = motor, ring: float = ring) -> np.ndarray:
            return added(teeth, x + dx, [motor - da, ring, ring])

        h, a = 1e-10, 1e-6
        here = at(0, 0)
        by_x, by_a = (at(h, 0) - at(-h, 0)) / (2 * h), (at(0, a) - at(0, -a)) / (2 * a)
        assert here[1] == pytest.approx(by_x[0], rel=1e-4, abs=1e-4 * scale)
        assert here[2] == pytest.approx(by_x[1], rel=1e-3, abs=1e-3 * scale / 1e-6)
        assert here[3] == pytest.approx(by_a[0], rel=1e-4, abs=1e-4 * scale * 1e-6)
        assert here[5] == pytest.approx(by_x[3], rel=1e-3, abs=1e-3 * scale)
        assert here[4] == pytest.approx(by_a[3], rel=1e-3, abs=1e-3 * scale * 1e-6)


@pytest.mark.parametrize("arrangement", ["circular_spline_fixed", "flexspline_fixed"])
@pytest.mark.parametrize("member", ["flexspline", "circular_spline"])
def test_a_lobe_meets_a_tooth_where_the_kinematics_say(member: str, arrangement: str) -> None:
    tooth = 31
    teeth = teeth_of({}, [ToothError(member=member, tooth=tooth, shift_um=20.0)], arrangement)
    ratio = teeth.drive.ratio
    count = 202 if member == "circular_spline" else 200
    fixed = member == arrangement.removesuffix("_fixed")
    # The place of the tooth turns with the output, or stands still; a lobe passes every half turn against it.
    speed = 1.0 if fixed else 1.0 - 1.0 / ratio
    for n in (0, 1, 2, 7, 60, 301):
        wanted = (2 * np.pi * tooth / count + n * np.pi) / speed
        motor = wanted + np.linspace(-0.6, 0.6, 241)
        output = motor / ratio
        ring = output if arrangement == "circular_spline_fixed" else 0.0 * output
        felt = [added(teeth, 2e-6, [m, f, o])[1] for m, f, o in zip(motor, ring, output, strict=True)]
        middle = float(np.sum(motor * felt) / np.sum(felt))
        assert middle == pytest.approx(wanted, abs=2e-3)
        assert felt[0] == felt[-1] == 0.0


@pytest.mark.parametrize("member", ["flexspline", "circular_spline"])
def test_the_output_moves_aside_by_what_balance_asks(member: str) -> None:
    # The twist at which all pairs together carry a torque, with and without the odd one, by the contact law.
    tooth, torque = 40, 52.0
    error = ToothError(member=member, tooth=tooth, shift_um=6.0)
    count = 202 if member == "circular_spline" else 200
    teeth = teeth_of({}, [error])
    motor = 2 * np.pi * tooth / count * (1.0 if member == "circular_spline" else 1 / (1 + 2 / 200))

    def force(x: float, odd: bool) -> float:
        angle = -motor * (1 + 2 / 200)
        total = float(_teeth.teeth_potential(teeth.parameters, x, angle)[1])
        return total + (float(added(teeth, x, [motor, -motor / 100, -motor / 100])[1]) if odd else 0.0)

    wanted = torque / teeth.lever_m
    alone = brentq(lambda x: force(x, False) - wanted, 0, 1e-4, xtol=1e-14)
    both = brentq(lambda x: force(x, True) - wanted, -1e-4, 1e-4, xtol=1e-14)
    # What one pair pushes, some fifty others in the arcs take.
    step = 1e-9
    plain = float(teeth.law.force(np.array(max(both - teeth.half_gaps_m[tooth], 0.0))))
    pushed = float(teeth.law.force(np.array(both + 6e-6 - teeth.half_gaps_m[tooth]))) - plain
    stiffness = (force(alone + step, False) - force(alone - step, False)) / (2 * step)
    assert 5e-8 < alone - both < 3e-7
    assert (alone - both) * stiffness == pytest.approx(pushed, rel=0.1)


@pytest.mark.parametrize("ring", ["dynamic", "static"])
@pytest.mark.parametrize("model", ["teeth", "tabulated"])
def test_a_run_with_odd_teeth_keeps_its_energy(model: str, ring: str) -> None:
    errors = {"tooth_error": {"member": "circular_spline", "tooth": 20.3, "shift_um": 25}}
    scenario = hdsim.Scenario.model_validate(
        {
            "drive": {"preset": "seed-2021", "mesh": {"model": model, "ring": ring}},
            "effects": errors,
            "command": {
                "motor": {
                    "type": "motion",
                    "trajectory": {"type": "sine", "amplitude_deg": 300, "frequency_hz": 2},
                }
            },
            "load": {"inertia_kg_m2": 0.5, "gravity": {"mass_kg": 4, "centre_of_mass_m": 0.3}},
            "run": {"duration_s": 0.4, "sample_rate_hz": 500, "teeth_rate_hz": 50},
        }
    )
    run = hdsim.simulate(scenario)
    assert np.max(np.abs(run["energy_residual"])) < 1e-5 * np.ptp(run["kinetic_energy"])


def test_the_logged_forces_are_those_with_the_odd_tooth() -> None:
    teeth = teeth_of({}, [ToothError(tooth=40, shift_um=4.0)])
    angles = np.array([2 * np.pi * 40 / 200, 0.0, 0.0])
    x = 2e-6
    forces, places = np.zeros(200), np.zeros(200)
    _teeth.tooth_forces(teeth.parameters, x, angles[1] - angles[0], forces, places)
    plain = forces.copy()
    _odd_tooth.odd_forces(teeth.parameters, x, angles, forces)
    assert np.flatnonzero(forces != plain).tolist() == [40]
    whole = _teeth.teeth_potential(teeth.parameters, x, angles[1] - angles[0])[1]
    whole += added(teeth, x, angles)[1]
    assert forces.sum() == pytest.approx(whole, rel=1e-10)
    assert forces[40] == pytest.approx(
        float(teeth.law.force(np.array(x + 4e-6 - teeth.half_gaps_m[40]))), rel=1e-3
    )
