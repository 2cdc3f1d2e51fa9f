"""Each effect against something independent of it: closed forms, limits, quadrature, catalogue figures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from operating_point import ARCMIN, RATIO, at
from pydantic import ValidationError
from scipy.integrate import quad

import hdsim.kernel as k
from hdsim.effects.base_flexibility import BaseFlexibility
from hdsim.effects.damaged_tooth import DamagedTooth
from hdsim.effects.flexspline_stiffening import FlexsplineStiffening
from hdsim.effects.input_coulomb_viscous import InputCoulombViscous
from hdsim.effects.kinematic_error import ErrorComponent, KinematicError
from hdsim.effects.motor_torque_ripple import MotorTorqueRipple, RippleComponent
from hdsim.effects.output_backlash import OutputBacklash
from hdsim.effects.output_eccentricity import OutputEccentricity
from hdsim.effects.stiffness_nonlinearity import StiffnessNonlinearity
from hdsim.effects.unbalance import Unbalance
from hdsim.effects.wave_generator_compliance import WaveGeneratorCompliance
from hdsim.effects.wave_generator_eccentricity import WaveGeneratorEccentricity
from hdsim.parts import Effect
from hdsim.testing.alone import Alone, Collector


def test_default_kinematic_error_has_the_catalogues_accuracy_and_orders() -> None:
    model = Alone(KinematicError())
    n = 20000
    motor = np.arange(n) / n * 100 * 2 * math.pi  # one output turn without load
    error = np.array([model.error(m, m / RATIO)[0] for m in motor])
    assert 0.7 * ARCMIN < np.ptp(error) < 1.1 * ARCMIN
    amplitude = 2 * np.abs(np.fft.rfft(error)) / n / ARCMIN  # bin = periods per output turn
    found = {i: round(a, 3) for i, a in enumerate(amplitude) if a > 1e-6}
    assert found == {1: 0.12, 2: 0.04, 100: 0.03, 200: 0.2, 202: 0.1, 400: 0.05}


def test_kinematic_error_needs_exactly_one_amplitude() -> None:
    for given in ({}, {"amplitude_rad": 1e-5, "amplitude_arcmin": 0.1}):
        with pytest.raises(ValidationError, match="exactly one"):
            ErrorComponent(order=2, **given)


def test_wave_generator_eccentricity_equals_the_two_lobes_moment_balance() -> None:
    effect = WaveGeneratorEccentricity(eccentricity_um=8, lobe_imbalance=0.3, pitch_radius_mm=20)
    offset = np.array([0.0, -8e-6])  # of the fixed spline's centre, m
    for motor in np.linspace(0, 7, 15):
        turned = 0.0
        for share, lobe in ((0.65, motor), (0.35, motor + math.pi)):
            tangent = np.array([-math.sin(lobe), math.cos(lobe)])
            turned += share * (offset @ tangent) / 20e-3
        # the offset of -y turns lobe 1 by -d cos(motor): the effect's phase is a quarter turn on
        assert Alone(effect).error(motor + 1.5 * math.pi, 0.0)[0] == pytest.approx(turned, abs=1e-12)


def test_output_eccentricity_is_one_period_per_output_turn() -> None:
    model = Alone(OutputEccentricity(eccentricity_um=5, radius_mm=25))
    values = [model.error(17.0 * x, x)[0] for x in np.linspace(0, 2 * math.pi, 9)]
    assert np.allclose(values, 2e-4 * np.sin(np.linspace(0, 2 * math.pi, 9)), atol=1e-15)


def test_damaged_tooth_is_felt_by_both_lobes_with_a_gaussians_width() -> None:
    width = math.radians(6)
    model = Alone(DamagedTooth(amplitude_arcmin=-0.3, width_deg=6, position_deg=30))
    start = math.radians(30)
    for turn in (0.0, math.pi, 2 * math.pi):
        assert model.error(start + turn + 0.5, 0.5)[0] == pytest.approx(
            -0.3 * ARCMIN
        )  # rides with the output
        assert model.error(start + turn + width, 0)[0] == pytest.approx(
            -0.3 * ARCMIN * math.exp(-0.5), rel=0.01
        )
    assert abs(model.error(start + math.pi / 2, 0)[0]) < 1e-9 * ARCMIN


def test_backlash_widens_by_half_on_each_side() -> None:
    build = Collector()
    OutputBacklash(backlash_arcmin=3).contribute(build)
    assert build.half_gap == pytest.approx(1.5 * ARCMIN)


def test_cogging_does_no_work_over_a_period_and_the_windings_share_follows_the_load() -> None:
    cogging = Alone(MotorTorqueRipple(components=(RippleComponent(order=24, cogging_nm=0.01, phase_deg=17),)))
    work, _ = quad(lambda a: at(cogging, MOTOR_ANGLE=a)[k.MOTOR_TORQUE], 0, 2 * math.pi / 24)
    assert work == pytest.approx(0, abs=1e-10)
    share = Alone(MotorTorqueRipple(components=(RippleComponent(order=6, share=0.02),)))
    angle = math.pi / 12
    assert at(share, MOTOR_ANGLE=angle, TRANSMITTED_TORQUE=50)[k.MOTOR_TORQUE] == pytest.approx(
        0.02 * 50 / RATIO
    )


def test_without_a_load_the_windings_ripple_is_a_share_of_the_friction() -> None:
    ripple = MotorTorqueRipple(components=(RippleComponent(order=6, share=0.02),))
    friction = InputCoulombViscous(coulomb_nm=0.03, viscous_nm_s_per_rad=2e-4)
    place = {"MOTOR_ANGLE": math.pi / 12, "MOTOR_VELOCITY": 200.0}
    alone = at(Alone(friction, base=1e-4), **place)[k.MOTOR_TORQUE]
    together = at(Alone(friction, ripple, base=1e-4), **place)[k.MOTOR_TORQUE]
    assert alone == pytest.approx(-(0.03 + 3e-4 * 200))
    assert together == pytest.approx(0.98 * alone)


def test_unbalance_is_a_pendulums_weight() -> None:
    model = Alone(Unbalance(output_kg_m=0.2))
    assert at(model, OUTPUT_ANGLE=0.0)[k.OUTPUT_TORQUE] == pytest.approx(-0.2 * 9.80665)
    rise = at(model, OUTPUT_ANGLE=math.pi / 2)[k.STORED] - at(model, OUTPUT_ANGLE=-math.pi / 2)[k.STORED]
    assert rise == pytest.approx(2 * 0.2 * 9.80665)


def test_cubic_spring_is_the_derivative_of_its_energy() -> None:
    model = Alone(StiffnessNonlinearity(cubic_nm_per_rad3=1e9))
    assert at(model, TWIST=2e-3)[k.TWIST_TORQUE] == pytest.approx(-8.0)
    work, _ = quad(lambda x: -at(model, TWIST=x)[k.TWIST_TORQUE], 0, 2e-3)
    assert at(model, TWIST=2e-3)[k.STORED] == pytest.approx(work)


def wind_up(effect: Effect, torque: float) -> float:
    build = Collector()
    effect.contribute(build)
    return float(build.compliances[0](np.array([torque]))[0])


def test_a_gradual_play_is_taken_up_to_three_quarters_at_its_torque_and_never_beyond_its_width() -> None:
    effect = OutputBacklash(backlash_arcmin=3, coefficient_per_nm=0.5)
    assert wind_up(effect, 2.0) == pytest.approx(1.5 * ARCMIN * math.tanh(1.0))
    assert wind_up(effect, -2.0) == -wind_up(effect, 2.0)
    assert wind_up(effect, 200.0) == pytest.approx(1.5 * ARCMIN)


def test_flexspline_wind_up_integrates_its_stiffness() -> None:
    effect = FlexsplineStiffening(stiffness_nm_per_rad=2e4, coefficient_per_nm=0.03)
    expected, _ = quad(lambda x: 1 / (2e4 * (1 + (0.03 * x) ** 2)), 0, 52)
    assert wind_up(effect, 52.0) == pytest.approx(expected)


def test_wave_generator_wind_up_integrates_its_stiffness_at_the_input() -> None:
    effect = WaveGeneratorCompliance(stiffness_nm_per_rad=6, coefficient_per_nm=1.5)
    at_input, _ = quad(lambda x: 1 / (6 * math.exp(1.5 * x)), 0, 52 / 100)
    assert wind_up(effect, 52.0) == pytest.approx(at_input / 100)
    assert wind_up(effect, 1e-3) == pytest.approx(1e-3 / (6 * 100**2), rel=1e-4)
    assert wind_up(effect, -52.0) == pytest.approx(-wind_up(effect, 52.0))


@pytest.mark.parametrize(("flexspline", "circular"), [(200, 202), (160, 162)])
def test_base_flexibility_equals_the_tooth_counts_lever(flexspline: int, circular: int) -> None:
    """Circular spline fixed: turning it by one turn turns the flexspline by z_c/z_f with the motor locked."""
    build = Collector(ratio=-flexspline / (circular - flexspline))
    BaseFlexibility(stiffness_nm_per_rad=1e5).contribute(build)
    expected = (circular / flexspline) ** 2 * 40 / 1e5
    assert build.compliances[0](np.array([40.0]))[0] == pytest.approx(expected)
