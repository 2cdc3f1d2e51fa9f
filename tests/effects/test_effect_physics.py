"""Each effect against something independent of it: closed forms, limits, quadrature, catalogue figures."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import quad, solve_ivp

import hdsim.kernel as k
from hdsim.effects.base_flexibility import BaseFlexibility
from hdsim.effects.damaged_tooth import DamagedTooth
from hdsim.effects.flexspline_stiffening import FlexsplineStiffening
from hdsim.effects.input_coulomb_viscous import InputCoulombViscous
from hdsim.effects.kinematic_error import ErrorComponent, KinematicError
from hdsim.effects.load_dependent_loss import LoadDependentLoss
from hdsim.effects.load_side_friction import LoadSideFriction
from hdsim.effects.lugre_friction import LugreFriction
from hdsim.effects.motor_torque_ripple import MotorTorqueRipple, RippleComponent
from hdsim.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from hdsim.effects.output_backlash import OutputBacklash
from hdsim.effects.output_eccentricity import OutputEccentricity
from hdsim.effects.stiffness_nonlinearity import StiffnessNonlinearity
from hdsim.effects.stribeck_friction import StribeckFriction
from hdsim.effects.thermal_friction import ThermalFriction
from hdsim.effects.torsional_hysteresis_duhem import TorsionalHysteresisDuhem
from hdsim.effects.torsional_hysteresis_maxwell import SlipElement, TorsionalHysteresisMaxwell
from hdsim.effects.unbalance import Unbalance
from hdsim.effects.wave_generator_compliance import WaveGeneratorCompliance
from hdsim.effects.wave_generator_eccentricity import WaveGeneratorEccentricity
from hdsim.parts import Effect
from hdsim.testing.alone import Alone, Collector

ARCMIN = math.radians(1 / 60)
RATIO = -100.0


def at(model: Alone, **values: float) -> np.ndarray:
    """Outputs of a model at the named inputs, e.g. ``MOTOR_VELOCITY=3``."""
    inputs = model.initial
    for name, value in values.items():
        inputs[getattr(k, name)] = value
    return model(inputs)[0]


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


def test_friction_of_the_catalogue_set_gives_the_measured_no_load_torques() -> None:
    for effects, base in (
        ((InputCoulombViscous(),), 0.0),
        ((InputCoulombViscous(viscous_nm_s_per_rad=0),), 3.5e-4),
    ):
        model = Alone(*effects, base=base)
        for rpm, torque in ((2000, 0.105), (3500, 0.160)):
            speed = rpm * 2 * math.pi / 60
            assert -at(model, MOTOR_VELOCITY=speed)[k.MOTOR_TORQUE] == pytest.approx(torque, rel=0.01)


def test_load_side_friction_opposes_the_output_only() -> None:
    model = Alone(LoadSideFriction(coulomb_nm=2, viscous_nm_s_per_rad=3))
    outputs = at(model, OUTPUT_VELOCITY=-1.5, MOTOR_VELOCITY=40)
    assert outputs[k.OUTPUT_TORQUE] == pytest.approx(2 + 4.5)
    assert outputs[k.MOTOR_TORQUE] == 0
    assert outputs[k.INPUT_FRICTION] == 0


def test_stribeck_bump_peaks_near_static_friction_and_vanishes_at_speed() -> None:
    effect = StribeckFriction(
        extra_static_nm=0.01, stribeck_velocity_rad_per_s=5, smoothing_velocity_rad_per_s=0.01
    )
    model = Alone(effect)
    speeds = np.array([0.1, 5.0, 50.0])
    torque = [at(model, MOTOR_VELOCITY=w)[k.INPUT_FRICTION] for w in speeds]
    assert np.allclose(torque, 0.01 * np.exp(-((speeds / 5) ** 2)), rtol=1e-6, atol=1e-20)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 1.7])
def test_the_stribeck_bump_of_any_exponent_is_the_general_exponential(exponent: float) -> None:
    effect = StribeckFriction(
        extra_static_nm=0.01, stribeck_velocity_rad_per_s=5, stribeck_exponent=exponent,
        smoothing_velocity_rad_per_s=1e-4,
    )  # fmt: skip
    model = Alone(effect)
    for speed in (0.01, -3.0, 5.0, 40.0):
        expected = math.copysign(0.01 * math.exp(-((abs(speed) / 5) ** exponent)), speed)
        assert at(model, MOTOR_VELOCITY=speed)[k.INPUT_FRICTION] == pytest.approx(expected, rel=1e-9)
    assert at(model, MOTOR_VELOCITY=0.0)[k.INPUT_FRICTION] == 0.0


@pytest.mark.parametrize("exponent", [0.3, 1.0, 2.0, 3.0])
def test_nonlinear_viscous_friction_is_a_power_of_the_speed(exponent: float) -> None:
    effect = NonlinearViscousFriction(
        drag_nm=0.02, speed_exponent=exponent, reference_speed_rad_per_s=50, smoothing_velocity_rad_per_s=1e-4
    )
    model = Alone(effect)
    for speed in (0.5, -3.0, 50.0, 400.0):
        outputs = at(model, MOTOR_VELOCITY=speed)
        expected = math.copysign(0.02 * (abs(speed) / 50) ** exponent, speed)
        assert outputs[k.INPUT_FRICTION] == pytest.approx(expected, rel=1e-6)
        assert outputs[k.MOTOR_TORQUE] == pytest.approx(-expected, rel=1e-6)
        assert outputs[k.DISSIPATED] == pytest.approx(expected * speed, rel=1e-6)
    assert at(model, MOTOR_VELOCITY=0.0)[k.INPUT_FRICTION] == 0.0


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_a_disk_coasts_down_under_a_power_of_its_speed_as_its_integral_says(exponent: float) -> None:
    # J w' = -D (w/w_r)^n: w = w_0 exp(-D t/(J w_r)), and w_0/(1 + w_0 D t/(J w_r^2)) at n = 2.
    inertia, drag, reference, first, time = 1e-4, 0.02, 50.0, 200.0, 0.3
    model = Alone(
        NonlinearViscousFriction(drag_nm=drag, speed_exponent=exponent, reference_speed_rad_per_s=reference)
    )
    found = solve_ivp(
        lambda t, w: [at(model, MOTOR_VELOCITY=w[0])[k.MOTOR_TORQUE] / inertia], (0, time), [first],
        rtol=1e-9, atol=1e-9,
    )  # fmt: skip
    rate = drag * time / (inertia * reference)
    expected = first * math.exp(-rate) if exponent == 1.0 else first / (1 + first * rate / reference)
    assert found.y[0, -1] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("exponent", [0.5, 1.3, 3.0])
@pytest.mark.parametrize("speed", [-0.02, 0.3, 7.0])
def test_slopes_of_friction_with_an_exponent_are_those_of_differences(exponent: float, speed: float) -> None:
    kinds = [
        StribeckFriction(stribeck_exponent=exponent),
        LugreFriction(stribeck_exponent=exponent),
        LoadDependentLoss(load_exponent=min(exponent, 2.0)),
        NonlinearViscousFriction(speed_exponent=exponent),
    ]
    for effect in kinds:
        model = Alone(effect)
        inputs = model.initial
        inputs[k.MOTOR_VELOCITY], inputs[k.TRANSMITTED_TORQUE] = speed, -3.0
        inputs[k.OWN :] = 1e-3
        slopes = model(inputs)[1]
        for column in (k.MOTOR_VELOCITY, k.TRANSMITTED_TORQUE):
            ahead, behind, step = inputs.copy(), inputs.copy(), 1e-6
            ahead[column], behind[column] = inputs[column] + step, inputs[column] - step
            expected = (model(ahead)[0] - model(behind)[0]) / (2 * step)
            expected[k.INPUT_FRICTION] = 0.0  # an output of its own: no equation depends on it
            assert slopes[:, column] == pytest.approx(expected, rel=1e-5, abs=1e-8)


def test_friction_with_an_exponent_has_a_slope_at_rest() -> None:
    kinds = (StribeckFriction, LugreFriction)
    powers = [kind(stribeck_exponent=0.5) for kind in kinds]
    for effect in (*powers, NonlinearViscousFriction(speed_exponent=0.5)):
        model = Alone(effect)
        assert np.all(np.isfinite(model(model.initial)[1]))


@pytest.mark.parametrize("exponent", [0.6, 2.0])
@pytest.mark.parametrize("speed", [0.05, 2.0, -8.0, 60.0])
def test_lugre_settles_on_the_stribeck_curve_at_any_steady_speed(speed: float, exponent: float) -> None:
    effect = LugreFriction(viscous_nm_s_per_rad=1e-3, stribeck_exponent=exponent)
    model = Alone(effect)
    slide = 40 * effect.static_nm / effect.stiffness_nm_per_rad
    times = np.linspace(0, slide / abs(speed), 50)
    z = model.follow(k.MOTOR_ANGLE, lambda t: speed * t, lambda t: speed, times)[0, -1]
    inputs = model.initial
    inputs[k.MOTOR_VELOCITY], inputs[k.OWN] = speed, z
    level = 0.032 + 0.008 * math.exp(-((abs(speed) / 5) ** exponent))
    expected = -(math.copysign(level, speed) + 1e-3 * speed)
    assert model(inputs)[0][k.MOTOR_TORQUE] == pytest.approx(expected, rel=1e-6)


def test_lugre_presliding_is_a_spring_of_the_bristles() -> None:
    model = Alone(LugreFriction(stiffness_nm_per_rad=20, damping_nm_s_per_rad=0))
    small = 1e-6  # rad: far below the break-away displacement of 2e-3
    z = model.follow(k.MOTOR_ANGLE, lambda t: small * t, lambda t: small, np.linspace(0, 1, 3))[0, -1]
    assert z == pytest.approx(small, rel=1e-3)
    inputs = model.initial
    inputs[k.OWN] = z
    assert model(inputs)[0][k.MOTOR_TORQUE] == pytest.approx(-20 * small, rel=1e-3)


def test_lugre_with_constant_bristle_damping_would_create_energy_where_the_fading_one_does_not() -> None:
    # The state that makes the heat smallest, s = 2, on a drive with strong damping: the bound is sharp there.
    effect = LugreFriction(damping_nm_s_per_rad=1.0, static_nm=0.064, coulomb_nm=0.032)
    model = Alone(effect)
    speeds = np.geomspace(1e-3, 1e3, 300)

    def heat(speed: float) -> float:
        level = 0.032 + 0.032 * math.exp(-((speed / 5) ** 2))
        inputs = model.initial
        inputs[k.MOTOR_VELOCITY], inputs[k.OWN] = speed, 2 * level / effect.stiffness_nm_per_rad
        return float(model(inputs)[0][k.DISSIPATED])

    assert min(heat(w) for w in speeds) >= 0
    constant = [4 * w * (0.032 + 0.032 * math.exp(-((w / 5) ** 2))) - 1.0 * w**2 for w in speeds]
    assert min(constant) < 0
    with pytest.raises(ValidationError, match="creates energy"):
        LugreFriction(damping_nm_s_per_rad=1.0, damping_velocity_rad_per_s=5.0)


def cycle(
    effect: TorsionalHysteresisMaxwell, amplitude: float, rate: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Twist and torque over two triangle cycles from rest, 400 samples a quarter, shape (n,) each."""
    model = Alone(effect)
    corners = amplitude * np.array([0, 1, 0, -1, 0, 1, 0, -1, 0.0])
    own, twist, torque = model.initial[k.OWN :], [0.0], [0.0]
    for start, stop in pairwise(corners):
        way = np.linspace(0, 1, 401)
        speed = rate * (stop - start)

        def slope(t: float, y: np.ndarray, speed: float = speed) -> np.ndarray:
            inputs = model.initial
            inputs[k.TWIST_RATE], inputs[k.OWN :] = speed, y
            return model(inputs)[0][k.OWN :]

        step = (
            0.005 / rate
        )  # a sharp element's slip lies between two steps of a solver that sees a straight line
        solved = solve_ivp(
            slope, (0, 1 / rate), own, "LSODA", way / rate, rtol=1e-9, atol=1e-9, max_step=step
        )
        own = solved.y[:, -1]
        twist += list(start + (stop - start) * way[1:])
        torque += list(solved.y.sum(axis=0)[1:])
    return np.array(twist), np.array(torque)


def test_maxwell_loop_has_the_area_of_ideal_elastoplastic_elements() -> None:
    elements = [(8000.0, 0.8), (3000.0, 0.9)]
    given = tuple(SlipElement(stiffness_nm_per_rad=a, slip_torque_nm=b) for a, b in elements)
    amplitude = 1e-3
    ideal = sum(4 * w * (amplitude - w / s) for s, w in elements)
    for sharpness, tolerance in ((12.0, 0.02), (200.0, 0.001)):
        x, f = cycle(TorsionalHysteresisMaxwell(elements=given, sharpness=sharpness), amplitude)
        area = abs(np.trapezoid(f[1600:], x[1600:]))  # second cycle: x and F close
        assert area == pytest.approx(ideal, rel=tolerance)


def test_maxwell_is_rate_independent_and_never_exceeds_its_slip_torque() -> None:
    effect = TorsionalHysteresisMaxwell()
    slow, fast = cycle(effect, 2e-3, 1.0)[1], cycle(effect, 2e-3, 1000.0)[1]
    assert np.allclose(slow, fast, atol=1e-5)
    assert 0.99 * 2.0 < np.abs(slow).max() < 2.0 + 1e-8


@pytest.mark.parametrize(("sharpness", "tolerance"), [(12, 0.03), (200, 0.002)])
def test_maxwell_obeys_masing(sharpness: float, tolerance: float) -> None:
    """After a reversal the branch is the virgin curve, doubled in both directions (Masing 1926)."""
    effect = TorsionalHysteresisMaxwell(sharpness=sharpness)
    x, f = cycle(effect, 1e-3)
    virgin_x, virgin_f = x[:401], f[:401]
    branch_x, branch_f = x[400:1201], f[400:1201]
    expected = virgin_f[-1] - 2 * np.interp((branch_x[0] - branch_x) / 2, virgin_x, virgin_f)
    assert np.abs(branch_f - expected).max() < tolerance * 2.0


@pytest.mark.parametrize(("count", "tolerance"), [(9, 0.02), (60, 0.003)])
def test_maxwell_shares_that_grow_with_the_square_of_the_twist_are_rayleighs_law(
    count: int, tolerance: float
) -> None:
    """Torque of the sliders at phi in proportion to phi dphi: a virgin curve W (2 u - u^2), u = x/phi_m.

    In a geometric series of twists dphi is in proportion to phi. A parabola's loops, by Masing, are those of
    Rayleigh 1887 (Philosophical Magazine 23:225): heat 4/3 nu x^3 in a cycle of amplitude x, nu = W/phi_m^2.
    """
    torque, last = 3.0, 0.8
    # Each slider stands for the twists around it, the last one for those below it alone.
    ratio = (last / 0.01) ** (1 / count) if count > 9 else math.sqrt(2.0)
    twists = tuple(last * ratio ** -(k + 0.5) for k in range(count))
    effect = TorsionalHysteresisMaxwell(slip_torque_nm=torque, slip_twists_mrad=twists, share_exponent=2.0)
    amplitude = 0.6e-3
    x, f = cycle(effect, amplitude)
    u = x[:401] / (1e-3 * last)
    assert np.abs(f[:401] - torque * (2 * u - u**2)).max() < tolerance * torque
    heat = 4 / 3 * torque / (1e-3 * last) ** 2 * amplitude**3
    assert abs(np.trapezoid(f[1600:], x[1600:])) == pytest.approx(heat, rel=2 * tolerance)


def test_maxwell_shares_are_of_the_whole_slip_torque() -> None:
    effect = TorsionalHysteresisMaxwell(slip_torque_nm=3.0, slip_twists_mrad=(0.1, 0.4), share_exponent=0.5)
    small, large = effect.slip_elements()
    assert small.slip_torque_nm + large.slip_torque_nm == pytest.approx(3.0, rel=1e-12)
    assert large.slip_torque_nm / small.slip_torque_nm == pytest.approx(2.0, rel=1e-12)
    assert large.slip_torque_nm / large.stiffness_nm_per_rad == pytest.approx(0.4e-3, rel=1e-12)


def test_maxwell_default_stays_within_the_catalogues_hysteresis_loss() -> None:
    """Below 1 arcmin of width at zero torque over K1 = 1.6e4 N m/rad: 2 sum W < 4.65 N m."""
    x, f = cycle(TorsionalHysteresisMaxwell(), 2.1e-3)
    up = np.interp(0.0, x[2000:2801][::-1], f[2000:2801][::-1])
    assert 2 * abs(up) < ARCMIN * 1.6e4


def test_duhem_branch_is_the_exponential() -> None:
    model = Alone(TorsionalHysteresisDuhem(stiffness_nm_per_rad=4000, saturation_torque_nm=2))
    times = np.linspace(0, 1, 20)
    z = model.follow(k.TWIST, lambda t: 1e-3 * t, lambda t: 1e-3, times)[0]
    assert np.allclose(z, 2 * (1 - np.exp(-2000 * 1e-3 * times)), atol=1e-7)
    slower = model.follow(k.TWIST, lambda t: 1e-5 * t, lambda t: 1e-5, 100 * times)[0]
    assert np.allclose(z, slower, atol=1e-6)
    by_twist = Alone(TorsionalHysteresisDuhem(saturation_torque_nm=2, saturation_twist_mrad=0.5))
    assert np.allclose(by_twist.follow(k.TWIST, lambda t: 1e-3 * t, lambda t: 1e-3, times)[0], z, atol=1e-9)


def test_duhem_of_exponent_two_loads_along_a_hyperbolic_tangent_and_unloads_along_a_tangent() -> None:
    """The solutions of dz/dx = A (1 -+ (z/z_s)^2) on both sides of a reversal."""
    model = Alone(TorsionalHysteresisDuhem(saturation_torque_nm=2, saturation_twist_mrad=0.5, exponent=2))
    times = np.linspace(0, 1, 40)
    up, down = times <= 0.5, times > 0.5
    z = model.follow(
        k.TWIST, lambda t: 1e-3 * min(t, 1 - t), lambda t: 1e-3 * (1 if t <= 0.5 else -1), times
    )[0]
    top = 2 * math.tanh(1.0)
    assert np.allclose(z[up], 2 * np.tanh(times[up] / 0.5), atol=1e-4)
    back = np.arctan(top / 2) - (times[down] - 0.5) / 0.5
    # Below zero the torque rises again along the hyperbolic tangent.
    expected = np.where(back > 0, 2 * np.tan(back), 2 * np.tanh(back))
    assert np.allclose(z[down], expected, atol=1e-3)


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


def soak(
    effect: ThermalFriction, speed: float, base: float, duration: float
) -> tuple[np.ndarray, np.ndarray, Alone]:
    model = Alone(effect, base=base)
    times = np.linspace(0, duration, 40)
    return times, model.follow(k.MOTOR_ANGLE, lambda t: 0.0, lambda t: speed, times)[0], model


def test_temperature_follows_the_exponential_of_a_constant_heat() -> None:
    effect = ThermalFriction(
        viscosity_coefficient_per_k=0, heat_capacity_j_per_k=400, thermal_resistance_k_per_w=2
    )
    times, temperature, _ = soak(effect, 200.0, 3e-4, 3000.0)
    rise = 2 * 3e-4 * 200.0**2
    assert np.allclose(temperature, 20 + rise * (1 - np.exp(-times / 800)), rtol=1e-6)


def test_warm_drive_settles_where_its_falling_friction_balances_the_cooling() -> None:
    effect = ThermalFriction()
    _, temperature, model = soak(effect, 300.0, 3.5e-4, 20000.0)
    warm = temperature[-1] - 20
    heat = 3.5e-4 * math.exp(-0.033 * warm) * 300.0**2
    assert warm == pytest.approx(1.5 * heat, rel=1e-6)
    inputs = model.initial
    inputs[k.MOTOR_VELOCITY], inputs[k.OWN] = 300.0, temperature[-1]
    assert model(inputs)[0][k.DISSIPATED] == pytest.approx(heat)


@pytest.mark.parametrize(("degc", "rpm", "nu"), [(40, 2000, 0.497), (-10, 2000, 2.858), (40, 3500, 0.497)])
def test_default_temperature_dependence_reproduces_palmgrens(degc: float, rpm: float, nu: float) -> None:
    """Palmgren's lubricant torque grows with (viscosity * speed)^(2/3); nu: relative to 20 C."""
    speed = rpm * 2 * math.pi / 60
    at_20 = 0.032 + 3.5e-4 * speed
    palmgren = at_20 * nu ** (2 / 3)
    model = Alone(InputCoulombViscous(viscous_nm_s_per_rad=0), ThermalFriction(), base=3.5e-4)
    inputs = model.initial
    inputs[k.MOTOR_VELOCITY], inputs[k.OWN] = speed, degc
    assert -model(inputs)[0][k.MOTOR_TORQUE] == pytest.approx(palmgren, rel=0.12)


def test_unbalance_is_a_pendulums_weight() -> None:
    model = Alone(Unbalance(output_kg_m=0.2))
    assert at(model, OUTPUT_ANGLE=0.0)[k.OUTPUT_TORQUE] == pytest.approx(-0.2 * 9.80665)
    rise = at(model, OUTPUT_ANGLE=math.pi / 2)[k.STORED] - at(model, OUTPUT_ANGLE=-math.pi / 2)[k.STORED]
    assert rise == pytest.approx(2 * 0.2 * 9.80665)


def test_load_dependent_loss_is_a_share_of_the_load_in_both_directions_of_power() -> None:
    model = Alone(LoadDependentLoss(coefficient=0.05))
    for load in (52.0, -52.0):
        for speed in (100.0, -100.0):
            torque = at(model, TRANSMITTED_TORQUE=load, MOTOR_VELOCITY=speed)[k.MOTOR_TORQUE]
            assert torque == pytest.approx(-math.copysign(0.05 * 52 / 100, speed), rel=0.02)


def test_a_loss_with_an_exponent_is_that_power_of_the_torque_and_its_share_at_the_reference() -> None:
    # A mesh's coefficient of friction goes with its force to the 0.2 (ISO/TR 14179-2).
    effect = LoadDependentLoss(coefficient=0.05, load_exponent=1.2, smoothing_torque_nm=1e-3)
    model = Alone(effect)
    for load in (13.0, -52.0, 104.0):
        torque = -at(model, TRANSMITTED_TORQUE=load, MOTOR_VELOCITY=90.0)[k.MOTOR_TORQUE]
        assert torque == pytest.approx(0.05 * 52.0 * (abs(load) / 52.0) ** 1.2 / 100, rel=1e-3)
        assert effect.loss_nm(abs(load)) == pytest.approx(100 * torque, rel=1e-3)
    assert effect.loss_nm(0.0) == 0.0


def test_cubic_spring_is_the_derivative_of_its_energy() -> None:
    model = Alone(StiffnessNonlinearity(cubic_nm_per_rad3=1e9))
    assert at(model, TWIST=2e-3)[k.TWIST_TORQUE] == pytest.approx(-8.0)
    work, _ = quad(lambda x: -at(model, TWIST=x)[k.TWIST_TORQUE], 0, 2e-3)
    assert at(model, TWIST=2e-3)[k.STORED] == pytest.approx(work)


def wind_up(effect: Effect, torque: float) -> float:
    build = Collector()
    effect.contribute(build)
    return float(build.compliances[0](np.array([torque]))[0])


@pytest.mark.parametrize("ratio", [-100.0, 51.0])
def test_a_loss_by_direction_gives_the_two_efficiencies(ratio: float) -> None:
    model = Alone(LoadDependentLoss(coefficient=0.25, back_driving_coefficient=0.1), ratio=ratio)
    for speed, load in ((150.0, 40.0), (-150.0, 40.0), (150.0, -40.0), (-150.0, -40.0)):
        # At steady speed the motor carries the load's torque over the ratio and the friction.
        motor = load / ratio - at(model, MOTOR_VELOCITY=speed, TRANSMITTED_TORQUE=load)[k.MOTOR_TORQUE]
        into, out = motor * speed, load * speed / ratio
        driving = out > 0
        efficiency = out / into if driving else into / out
        # 0.5 N m of 40 are rounded off.
        assert efficiency == pytest.approx(1 / 1.25 if driving else 0.9, rel=5e-3)


def test_a_loss_without_directions_is_the_same_in_both() -> None:
    both = [
        Alone(LoadDependentLoss(coefficient=0.1)),
        Alone(LoadDependentLoss(coefficient=0.1, back_driving_coefficient=0.1)),
    ]
    for speed in (-0.3, 0.2, 90.0):
        torques = [at(m, MOTOR_VELOCITY=speed, TRANSMITTED_TORQUE=-7.0)[k.MOTOR_TORQUE] for m in both]
        assert torques[0] == torques[1]


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
