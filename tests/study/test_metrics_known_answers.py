"""Metrics find what was planted in simulated drives."""

import math

import numpy as np
import pytest

from hdsim.drive.parameters import Drive
from hdsim.errors import InputError
from hdsim.recording import Column, Recording, Table
from hdsim.simulation.simulate import simulate
from hdsim.studies.bench import torsion, transmission
from hdsim.studies.known_metrics import find_metric
from hdsim.studies.metrics.torsion import torsion_loop
from hdsim.studies.metrics.transmission import orders, transmission_error

ARCSEC = 180 * 3600 / math.pi
SEED = {"preset": "seed-2021"}
LUMPED = {"preset": "seed-2021", "mesh": {"model": "lumped"}}

#: Order per turn of, amplitude in arcmin, and where it appears.
PLANTED = [
    (2, "wave_generator_turn", 0.20, "order_2"),
    (2, "relative_turn", 0.10, "order_2_relative"),
    (4, "wave_generator_turn", 0.05, "order_4"),
    (4, "relative_turn", 0.04, "order_4_relative"),
    (1, "wave_generator_turn", 0.03, "order_1"),
    (1, "output_turn", 0.12, "order_1_output"),
    (2, "output_turn", 0.06, "order_2_output"),
]


@pytest.fixture(scope="module", params=["circular_spline_fixed", "flexspline_fixed"])
def turning(request):
    components = [
        {"order": n, "per": per, "amplitude_arcmin": a, "phase_deg": 37.0 * k}
        for k, (n, per, a, _) in enumerate(PLANTED)
    ]
    scenario = transmission.build(
        LUMPED | {"arrangement": request.param}, effects={"kinematic_error": {"components": components}}
    )
    return scenario, simulate(scenario)


@pytest.mark.parametrize(("order", "per", "arcmin", "name"), PLANTED)
def test_planted_orders_are_recovered_within_one_percent(turning, order, per, arcmin, name) -> None:
    scenario, recording = turning
    found = find_metric(f"transmission_error_{name}")(recording, scenario)
    assert found == pytest.approx(60 * arcmin, rel=0.01)
    backward = transmission_error(recording, scenario.drive.ratio, -1)
    assert ARCSEC * backward.amplitude(orders(scenario)[name]) == pytest.approx(60 * arcmin, rel=0.01)


def test_orders_2_and_2_02_are_different_lines_and_nothing_else_is_there(turning) -> None:
    scenario, recording = turning
    error = transmission_error(recording, scenario.drive.ratio, +1)
    order, amplitude = error.spectrum
    strong = order[ARCSEC * amplitude > 0.5]
    np.testing.assert_allclose(strong, sorted(orders(scenario).values()), atol=1e-9)


def test_accuracy_is_the_peak_to_peak_of_the_planted_error(turning) -> None:
    scenario, recording = turning
    ratio = scenario.drive.ratio
    turn = 2 * math.pi * abs(ratio) * np.linspace(0, 1, 400_001)
    error = np.zeros_like(turn)
    for k, (n, per, a, _) in enumerate(PLANTED):
        angle = {
            "wave_generator_turn": turn,
            "output_turn": turn / ratio,
            "relative_turn": turn * (1 - 1 / ratio),
        }
        error += 60 * a * np.sin(n * angle[per] + math.radians(37 * k))
    found = find_metric("transmission_accuracy")(recording, scenario)
    assert found == pytest.approx(np.ptp(error), rel=0.01)


def test_a_synthetic_error_is_recovered_exactly_from_uneven_samples() -> None:
    ratio = -100.0
    time = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 60_000)) * 4e-4
    motor = -2 * math.pi * 5 * time
    error = 1e-5 + 5e-5 * np.sin(2 * motor + 1) + 2e-5 * np.sin(2.02 * motor)
    columns = {
        "motor_angle": motor,
        "motor_velocity": np.gradient(motor, time),
        "output_angle": motor / ratio + error,
    }
    recording = Recording({"state": Table(time, {k: Column(v, "") for k, v in columns.items()})})
    found = transmission_error(recording, ratio, +1)
    assert found.amplitude(2.0) == pytest.approx(5e-5, rel=1e-4)
    assert found.amplitude(2.02) == pytest.approx(2e-5, rel=1e-4)
    assert found.mean == pytest.approx(1e-5, rel=1e-4)
    with pytest.raises(InputError, match="negative direction"):
        transmission_error(recording, ratio, -1)


def test_less_than_a_turn_is_refused() -> None:
    time = np.linspace(0, 1, 500)
    motor = 2 * math.pi * 50 * time
    columns = {"motor_angle": motor, "motor_velocity": np.gradient(motor, time), "output_angle": motor / 101}
    recording = Recording({"state": Table(time, {k: Column(v, "") for k, v in columns.items()})})
    with pytest.raises(InputError, match=r"0\.495 turns"):
        transmission_error(recording, 101.0, +1)


def test_torsion_of_the_catalogue_spring_has_its_stiffness_and_no_loss() -> None:
    scenario = torsion.build(LUMPED)
    recording = simulate(scenario)
    drive = Drive.model_validate(SEED).torsion
    for k in (1, 2, 3):
        printed = getattr(drive, f"stiffness_k{k}_nm_per_rad")
        assert find_metric(f"stiffness_k{k}")(recording, scenario) == pytest.approx(printed, rel=0.002)
    rated = scenario.drive.rated_torque_nm
    for name, share in (("lost_motion", 0.03), ("lost_motion_4_percent", 0.04)):
        elastic = ARCSEC * 2 * share * rated / drive.stiffness_k1_nm_per_rad
        assert find_metric(name)(recording, scenario) == pytest.approx(elastic, rel=0.005)
    assert find_metric("hysteresis_loss")(recording, scenario) < 0.3
    assert abs(find_metric("backlash")(recording, scenario)) < 0.1


def test_a_planted_dead_zone_is_found_as_backlash_and_lost_motion() -> None:
    # Stiff steel-on-steel teeth, all with the same gap: free play 2 b / (r cos alpha) at the output.
    half_gap, elastic = 3e-6, {}
    for gap in (0.0, half_gap):
        mesh = {"half_gap_m": gap, "contact": {"law": "constant", "contact_stiffness_n_per_m": 6e7}}
        scenario = torsion.build(SEED | {"mesh": mesh}, period_s=40.0)
        recording = simulate(scenario)
        elastic[gap] = {
            name: find_metric(name)(recording, scenario)
            for name in ("lost_motion", "backlash", "stiffness_k1")
        }
    geometry = scenario.drive.geometry
    play = (
        ARCSEC
        * 2
        * half_gap
        / (geometry.pitch_radius_m * math.cos(math.radians(geometry.pressure_angle_deg)))
    )
    assert elastic[half_gap]["backlash"] == pytest.approx(play, rel=0.02)
    spring = elastic[0.0]
    assert abs(spring["backlash"]) < 0.01 * play
    # The catalogue's K1 contains the play: the structure between play and T1 is stiffer by as much.
    torque, edge = scenario.drive.torsion.torque_t1_nm, 0.03 * scenario.drive.rated_torque_nm
    rest = 2 * edge / torque * (ARCSEC * torque / scenario.drive.torsion.stiffness_k1_nm_per_rad - play / 2)
    assert elastic[half_gap]["lost_motion"] == pytest.approx(play + rest, rel=0.02)


def test_a_planted_maxwell_slip_loop_has_its_loss_and_heat() -> None:
    # Linear spring K, one slider k, W: the loop's sides at zero torque are W/K from the centre; the heat is
    # 4 W (A - W/k) with A the amplitude of the twist (Masing).
    spring, slider, slip, top = 16000.0, 20000.0, 2.0, 52.0
    stiffness = {f"stiffness_k{k}_nm_per_rad": spring for k in (1, 2, 3)}
    effects = {
        "torsional_hysteresis_maxwell": {
            "elements": [{"stiffness_nm_per_rad": slider, "slip_torque_nm": slip}],
            "sharpness": 60,
        }
    }
    scenario = torsion.build(LUMPED | {"torsion": stiffness}, effects=effects)
    recording = simulate(scenario)
    assert find_metric("hysteresis_loss")(recording, scenario) == pytest.approx(
        ARCSEC * 2 * slip / spring, rel=0.02
    )
    amplitude = (top - slip) / spring
    heat = 4 * slip * (amplitude - slip / slider)
    assert find_metric("torsional_heat_per_cycle")(recording, scenario) == pytest.approx(heat, rel=0.02)
    # The centre line near zero torque is the spring's, the sliders being through.
    edge = 0.03 * scenario.drive.rated_torque_nm
    assert find_metric("lost_motion")(recording, scenario) == pytest.approx(
        ARCSEC * 2 * edge / spring, rel=0.02
    )


def test_a_torsion_cycle_asks_for_a_locked_motor_and_a_whole_cycle() -> None:
    time = np.linspace(0, 1, 100)
    columns = {"load_torque": time, "output_angle": time, "motor_angle": time}
    recording = Recording({"state": Table(time, {k: Column(v, "") for k, v in columns.items()})})
    with pytest.raises(InputError, match="locked motor"):
        torsion_loop(recording)
    recording.state.columns["motor_angle"] = Column(0 * time, "")
    with pytest.raises(InputError, match="does not come back"):
        torsion_loop(recording)
