"""The numbers that a plant is made of. Units are SI.

Where a number is named ``*_form``, 0 takes a formula that differs from the catalogue's and 1 the catalogue's
own. Torques on the motor are at the motor shaft, twists and angles of errors at the output.
"""

from __future__ import annotations

from typing import NamedTuple


class Numbers(NamedTuple):
    """Everything that a plant is made of."""

    ratio: float = -100.0
    motor_inertia: float = 6.93e-5
    load_inertia: float = 0.5
    k1: float = 1.6e4
    k2: float = 2.5e4
    k3: float = 2.9e4
    t1: float = 7.0
    t2: float = 25.0
    damping: float = 8.0
    coulomb: float = 0.03
    viscous: float = 3.5e-4
    load_loss: float = 0.06
    arm: float = 12.0
    gain: float = 1.0
    sign_speed: float = 0.5
    algebraic_sign: float = 0.0
    locked: float = 0.0
    # kinematic error: orders 2 and 4 of the motor, 2 of motor against output, 6 of the motor, 3 of the output
    ke_2: float = 0.0
    ke_2_phase: float = 0.0
    ke_rel: float = 0.0
    ke_rel_phase: float = 0.0
    ke_4: float = 0.0
    ke_4_phase: float = 0.0
    ke_6: float = 0.0
    ke_out3: float = 0.0
    wg_once: float = 0.0
    wg_once_phase: float = 0.0
    wg_once_skew: float = 0.0
    out_once: float = 0.0
    out_once_phase: float = 0.0
    # stiffness that varies with the motor's angle, order 2
    uneven: float = 0.0
    uneven_phase: float = 0.0
    uneven_form: float = 0.0
    # damaged tooth
    bump: float = 0.0
    bump_at: float = 0.0
    bump_width: float = 0.3
    bump_passes: float = 2.0
    bump_output: float = 1.0
    bump_form: float = 0.0
    # friction on the motor
    stribeck: float = 0.0
    stribeck_speed: float = 5.0
    stribeck_form: float = 0.0
    bristle: float = 0.0
    bristle_coulomb: float = 0.0
    bristle_static: float = 0.0
    bristle_speed: float = 5.0
    bristle_damping: float = 0.0
    bristle_form: float = 0.0
    extra_coulomb: float = 0.0
    extra_viscous: float = 0.0
    extra_power: float = 1.0
    extra_loss: float = 0.0
    loss_power: float = 1.0
    loss_scale: float = 1.0
    loss_form: float = 0.0
    # that varies with the motor's angle, orders 1 and 2
    lumpy_1: float = 0.0
    lumpy_1_phase: float = 0.0
    lumpy_2: float = 0.0
    lumpy_2_phase: float = 0.0
    lumpy_form: float = 0.0
    # of a ball that is larger than the others, each time that it meets a lobe
    ball: float = 0.0
    ball_phase: float = 0.0
    ball_share: float = 0.095
    ball_form: float = 0.0
    thermal: float = 0.0
    heat_capacity: float = 8.0
    thermal_resistance: float = 1.5
    thermal_form: float = 0.0
    # torque ripple of the motor
    ripple_a: float = 0.0
    ripple_a_order: float = 12.0
    ripple_a_phase: float = 0.0
    ripple_b: float = 0.0
    ripple_b_order: float = 24.0
    ripple_b_phase: float = 0.0
    ripple_c: float = 0.0
    ripple_c_order: float = 4.0
    ripple_c_phase: float = 0.0
    motor_weight: float = 0.0
    motor_weight_phase: float = 0.0
    # load side
    load_coulomb: float = 0.0
    load_viscous: float = 0.0
    load_sign_speed: float = 0.005
    load_form: float = 0.0
    weight: float = 0.0
    weight_phase: float = 0.0
    # torque that a bench puts on the output, over time
    known_a: float = 0.0
    known_a_hz: float = 0.3
    known_b: float = 0.0
    known_b_hz: float = 1.0
    known_phase: float = 0.0
    # spring
    gap: float = 0.0
    gap_rounding: float = 0.0
    cubic: float = 0.0
    cubic_scale: float = 1e-3
    cubic_form: float = 0.0
    flexspline: float = 0.0
    flexspline_coefficient: float = 0.02
    flexspline_form: float = 0.0
    generator: float = 0.0
    generator_coefficient: float = 1.0
    generator_form: float = 0.0
    maxwell: float = 0.0
    maxwell_reach: float = 6e-4
    maxwell_form: float = 0.0
    maxwell_power: float = 0.0  # how suddenly a slider slips; 0: at once
    duhem: float = 0.0
    duhem_stiffness: float = 5e3
    duhem_power: float = 1.0
    mount: float = 0.0  # compliance
    mount_inertia: float = 0.0
    mount_damping: float = 0.0
    warm: float = 0.0  # softer by this share for every kelvin above 20 degC
    warm_form: float = 0.0
    # sensors
    delay: float = 0.0
    encoder_once: float = 0.0
    encoder_phase: float = 0.0
    sensor_ripple: float = 0.0
    sensor_order: float = 2.0
    sensor_phase: float = 0.0
    sensor_load: float = 0.0
    sensor_second: float = 0.0
    # outside the catalogue
    cable: float = 0.0
    cable_at: float = 0.15
    cable_width: float = 0.3
    catch: float = 0.0
    catch_at: float = 0.25
    catch_width: float = 0.05
    drift: float = 0.0
    churn: float = 0.0
    cogging: float = 0.0
    cogging_order: float = 7.0
    absorber: float = 0.0
    absorber_inertia: float = 0.1
    zone: float = 0.0
    zone_at: float = 0.0
    zone_width: float = 0.1
    brake: float = 0.0
    saturation: float = 0.0
