"""Laws of friction, losses and temperature alone, against closed forms and published numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from operating_point import at
from pydantic import ValidationError
from scipy.integrate import solve_ivp

import hdsim.kernel as k
from hdsim.effects.input_coulomb_viscous import InputCoulombViscous
from hdsim.effects.load_dependent_loss import LoadDependentLoss
from hdsim.effects.load_side_friction import LoadSideFriction
from hdsim.effects.lugre_friction import LugreFriction
from hdsim.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from hdsim.effects.stribeck_friction import StribeckFriction
from hdsim.effects.thermal_friction import ThermalFriction
from hdsim.testing.alone import Alone


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
