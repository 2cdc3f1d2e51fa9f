"""Plants with a hidden effect, written apart from hdsim: own equations, own integrator.

Coordinates are motor angle m, output angle o, the housing's angle b and a spring-mounted mass a; a cascaded
PI controller follows a reference at 10 kHz. Nothing here imports hdsim. Units are SI.
"""

from __future__ import annotations

import math

import numpy as np
from motions import CONTROL_RATE
from numba import njit
from plant_numbers import Numbers
from plant_springs import SLIDERS, bristle_after, slider, slipped, spring_table, spring_torque

STEPS = 2  # of the integrator in each period of the controller
STEP = 1.0 / (CONTROL_RATE * STEPS)  # s


@njit(cache=True)
def sign_of(speed, over, algebraic):
    """A smooth sign."""
    if algebraic > 0:
        return speed / math.sqrt(speed * speed + 0.36 * over * over)
    return math.tanh(speed / over)


@njit(cache=True)
def error_of(m, o, p):
    """Kinematic error and its derivatives with respect to motor and output angle."""
    e = p.ke_2 * math.sin(2 * m + p.ke_2_phase) + p.ke_4 * math.sin(4 * m + p.ke_4_phase)
    by_m = 2 * p.ke_2 * math.cos(2 * m + p.ke_2_phase) + 4 * p.ke_4 * math.cos(4 * m + p.ke_4_phase)
    turn = 2 * (m - o) + p.ke_rel_phase
    e += p.ke_rel * math.sin(turn) + p.ke_6 * math.sin(6 * m + 0.3)
    by_m += 2 * p.ke_rel * math.cos(turn) + 6 * p.ke_6 * math.cos(6 * m + 0.3)
    by_o = -2 * p.ke_rel * math.cos(turn)
    e += p.ke_out3 * math.sin(3 * o + 0.9) + p.out_once * math.sin(o + p.out_once_phase)
    by_o += 3 * p.ke_out3 * math.cos(3 * o + 0.9) + p.out_once * math.cos(o + p.out_once_phase)
    if p.wg_once > 0:
        # With a skew the offset is seen in perspective: sin/(1 + k cos).
        s, c = math.sin(m + p.wg_once_phase), math.cos(m + p.wg_once_phase)
        below = 1.0 + p.wg_once_skew * c
        e += p.wg_once * s / below
        by_m += p.wg_once * (c * below + p.wg_once_skew * s * s) / (below * below)
    if p.bump != 0:
        n = p.bump_passes
        u = n * (m - p.bump_output * o - p.bump_at)
        value, slope = 0.0, 0.0
        if p.bump_form > 0:
            kappa = 1.0 / (n * p.bump_width) ** 2
            value = math.exp(kappa * (math.cos(u) - 1.0))
            slope = -n * kappa * math.sin(u) * value
        else:
            # A lopsided raised cosine: a steep entry, a longer way out.
            u = (u - 2 * math.pi * round(u / (2 * math.pi))) / n / (1.6 * p.bump_width)
            if abs(u) < 1.0:
                value = 0.5 * (1 + math.cos(math.pi * u)) * (1 + 0.4 * u)
                slope = 0.2 * (1 + math.cos(math.pi * u)) - 0.5 * math.pi * math.sin(math.pi * u) * (
                    1 + 0.4 * u
                )
                slope /= 1.6 * p.bump_width
        e += p.bump * value
        by_m += p.bump * slope
        by_o -= p.bump_output * p.bump * slope
    return e, by_m, by_o


@njit(cache=True)
def uneven_at(m, p):
    """What the spring is stiffer by at a motor angle, and its derivative."""
    u = 2 * m + p.uneven_phase
    # Else lobes of which one is sharper.
    bend = 0.0 if p.uneven_form > 0 else 0.5
    inside = u + bend * math.sin(u)
    return p.uneven * math.sin(inside), 2 * p.uneven * math.cos(inside) * (1 + bend * math.cos(u))


@njit(cache=True)
def load_at(o, p):
    """Torque of the load that is a function of the output angle."""
    load = p.arm * math.sin(o) + p.weight * math.cos(o + p.weight_phase)
    load += p.cable * math.tanh((o - p.cable_at) / p.cable_width) ** 3
    load += p.catch * math.exp(-(((o - p.catch_at) / p.catch_width) ** 2))
    return load + p.cogging * math.sin(p.cogging_order * o + 0.5)


@njit(cache=True)
def known_load(t, p):
    """Torque that a bench puts on the output; it comes on within half a second, and the drive was at rest."""
    s = min(1.0, t / 0.5)
    torque = p.known_a * math.sin(2 * math.pi * p.known_a_hz * t)
    torque += p.known_b * math.sin(2 * math.pi * p.known_b_hz * t + p.known_phase)
    return s * s * (3.0 - 2.0 * s) * torque


@njit(cache=True)
def known_loads(times, p):
    """That torque at many times: a call for each would spend its time on handing over the numbers."""
    found = np.zeros(len(times))
    for k in range(len(times)):
        found[k] = known_load(times[k], p)
    return found


@njit(cache=True)
def rates(t, s, y, torque, p, table, reach, bristle, sliders, twist0, dy, out):
    """The state: motor angle, speed; output; housing; mounted mass (each so); Duhem torque; temperature.

    ``s`` is the time since the step began; bristles and sliders are solved exactly within a step.
    """
    m, wm, o, wo, b, wb = y[0], y[1], y[2], y[3], y[4], y[5]
    e, by_m, by_o = error_of(m, o, p)
    housing = 1.0 - 1.0 / p.ratio
    twist = m / p.ratio + e - o + housing * b
    rate = wm * (1.0 / p.ratio + by_m) + wo * (by_o - 1.0) + housing * wb
    # Else faster the warmer it is.
    above = y[9] - 20.0
    softer = p.warm * above * (1.0 if p.warm_form > 0 else 0.7 + 0.03 * above)
    tau = spring_torque(twist, table, reach, p) * (1.0 - softer) + p.damping * rate
    uneven, by_angle = uneven_at(m, p)
    tau += uneven * twist
    if p.maxwell > 0:
        for k in range(SLIDERS):
            share, far = slider(k, p)
            tau += slipped(sliders[k], twist - twist0, share, far, p)
    dy[8] = 0.0
    if p.duhem > 0:
        z = y[8]
        tau += z
        fill = abs(z / p.duhem) ** p.duhem_power * math.copysign(1.0, z)
        dy[8] = p.duhem_stiffness * (rate - abs(rate) * fill)
    sign = sign_of(wm, p.sign_speed, p.algebraic_sign)
    carried = abs(tau / p.ratio)
    viscous = p.viscous * wm
    if p.thermal > 0:
        if p.thermal_form > 0:
            viscous *= math.exp(-p.thermal * (y[9] - 20.0))
        else:
            # Andrade's law of the absolute temperature.
            viscous *= math.exp(p.thermal * 293.15**2 * (1.0 / (y[9] + 273.15) - 1.0 / 293.15))
    friction = (p.coulomb + p.load_loss * carried) * sign + viscous
    if p.stribeck > 0:
        over = wm / p.stribeck_speed
        # Hess and Soom's form instead of the Gaussian.
        friction += (
            p.stribeck * sign * (math.exp(-over * over) if p.stribeck_form > 0 else 1 / (1 + over * over))
        )
    if p.bristle > 0:
        z, relax = bristle_after(bristle, wm, s, p)
        friction += p.bristle * z
        fading = wm / p.bristle_speed
        friction += p.bristle_damping * math.exp(-fading * fading) * (wm - relax * z)
    friction += p.extra_coulomb * sign + p.extra_viscous * math.copysign(abs(wm) ** p.extra_power, wm)
    if p.extra_loss > 0:
        if p.loss_form > 0:
            level = math.sqrt(tau * tau + 0.25) - 0.5
            friction += p.extra_loss * level / abs(p.ratio) * math.tanh(wm / 0.5)
        else:
            friction += p.extra_loss * carried * (carried / p.loss_scale) ** (p.loss_power - 1.0) * sign
    if p.lumpy_1 + p.lumpy_2 > 0:
        once, twice = math.sin(m + p.lumpy_1_phase), math.sin(2 * m + p.lumpy_2_phase)
        if p.lumpy_form > 0:
            friction += (p.lumpy_1 * (1 + once) + p.lumpy_2 * (1 + twice)) * sign
        else:
            # Narrower where it is tight than where it is easy.
            friction += (p.lumpy_1 * math.exp(once) + p.lumpy_2 * math.exp(twice)) * sign
    if p.ball > 0:
        # Ball diameter over pitch diameter; the outer ring turns with a flexspline that is the output.
        met = math.sin((1.0 + p.ball_share) * (m - (o if p.ratio < 0 else 0.0)) + p.ball_phase)
        friction += p.ball * (1.0 + met if p.ball_form > 0 else math.exp(met)) * sign
    friction += p.churn * wm * abs(wm)
    friction += p.zone * sign * math.exp(-(((o - p.zone_at) / p.zone_width) ** 2))
    if p.brake > 0:
        friction += p.brake * sign * 0.5 * (math.tanh((t - 4.0) / 0.05) - math.tanh((t - 6.5) / 0.05))
    drive = torque + p.ripple_a * math.sin(p.ripple_a_order * m + p.ripple_a_phase)
    drive += p.ripple_b * math.sin(p.ripple_b_order * m + p.ripple_b_phase)
    drive += p.ripple_c * math.sin(p.ripple_c_order * m + p.ripple_c_phase)
    drive -= p.motor_weight * math.cos(m + p.motor_weight_phase)
    drive += p.drift * math.sin(2 * math.pi * t / 5.3) * math.exp(-t / 9.0)
    load = load_at(o, p)
    load -= known_load(t, p)
    load += p.load_coulomb * sign_of(wo, p.load_sign_speed, 1.0 - p.load_form) + p.load_viscous * wo
    dy[6], dy[7] = y[7], 0.0
    if p.absorber > 0:
        pull = p.absorber * (y[6] - o) + 0.04 * math.sqrt(p.absorber * p.absorber_inertia) * (y[7] - wo)
        load -= pull
        dy[7] = -pull / p.absorber_inertia
    dy[0] = wm
    # From the potential uneven twist^2 / 2.
    back = tau * (1.0 / p.ratio + by_m) + 0.5 * twist * twist * by_angle
    dy[1] = (drive - friction - back) / p.motor_inertia
    dy[2] = wo
    dy[3] = (tau * (1.0 - by_o) - load) / p.load_inertia
    if p.locked > 0:
        dy[2] = dy[3] = 0.0
    dy[4] = dy[5] = 0.0
    if p.mount > 0:
        dy[4] = wb
        dy[5] = (-housing * tau - b / p.mount - p.mount_damping * wb) / p.mount_inertia
    heat = friction * wm + p.damping * rate * rate
    dy[9] = (heat - (y[9] - 20.0) / p.thermal_resistance) / p.heat_capacity
    out[0], out[1] = tau, twist


@njit(cache=True)
def motor_at(motion, k, share, y):
    """Put the prescribed motor angle and speed into a state: cubic Hermite between two ticks."""
    last = min(k + 1, len(motion) - 1)
    h, s = 1.0 / CONTROL_RATE, share
    m0, v0, m1, v1 = motion[k, 0], h * motion[k, 1], motion[last, 0], h * motion[last, 1]
    c2, c3 = 3 * (m1 - m0) - 2 * v0 - v1, 2 * (m0 - m1) + v0 + v1
    if last == k:
        c2, c3 = 0.0, 0.0
    y[0] = m0 + s * (v0 + s * (c2 + s * c3))
    y[1] = (v0 + s * (2 * c2 + 3 * s * c3)) / h


@njit(cache=True)
def integrate(angle, speed, motion, start, p, table, reach, gains, log):
    """Fourth-order Runge-Kutta; the controller holds its torque for a period.

    With a ``motion`` (motor angle, speed and acceleration at every tick) the motor follows it instead, and
    the torque is what that takes.
    """
    y, y1 = np.zeros(10), np.zeros(10)
    a, b, c, d = np.zeros(10), np.zeros(10), np.zeros(10), np.zeros(10)
    out, sliders, bristle, integral = np.zeros(2), np.zeros(SLIDERS), 0.0, start[2]
    y[0], y[1] = p.ratio * angle[0], p.ratio * speed[0]
    y[2], y[3] = start[0], (1.0 - p.locked) * speed[0]
    y[4], y[6], y[7], y[9] = start[1], y[2], y[3], 20.0
    rates(0.0, 0.0, y, 0.0, p, table, reach, bristle, sliders, 0.0, a, out)
    twist0, h = out[1], STEP
    for k in range(len(angle)):
        error = p.ratio * speed[k] + gains[2] * (p.ratio * angle[k] - y[0]) - y[1]
        integral = min(gains[3], max(-gains[3], integral + gains[1] * error / CONTROL_RATE))
        torque = min(4 * gains[3], max(-4 * gains[3], gains[0] * error + integral))
        t = k / CONTROL_RATE
        if motion.shape[0] > 0:
            motor_at(motion, k, 0.0, y)
            rates(t, 0.0, y, 0.0, p, table, reach, bristle, sliders, twist0, a, out)
            torque = (motion[k, 2] - a[1]) * p.motor_inertia
        rates(t, 0.0, y, torque, p, table, reach, bristle, sliders, twist0, a, out)
        log[k, 0], log[k, 1], log[k, 2], log[k, 3], log[k, 4] = y[0], torque, y[2], out[0], y[9]
        log[k, 5], log[k, 6] = y[1], a[1]
        for i in range(STEPS):
            if motion.shape[0] > 0:
                # The first stage's motor is that of the Hermite curve, as are the others'.
                motor_at(motion, k, i / STEPS, y)
            rates(t, 0.0, y, torque, p, table, reach, bristle, sliders, twist0, a, out)
            y1[:] = y + h / 2 * a
            if motion.shape[0] > 0:
                motor_at(motion, k, (i + 0.5) / STEPS, y1)
            rates(t, h / 2, y1, torque, p, table, reach, bristle, sliders, twist0, b, out)
            y1[:] = y + h / 2 * b
            if motion.shape[0] > 0:
                motor_at(motion, k, (i + 0.5) / STEPS, y1)
            rates(t, h / 2, y1, torque, p, table, reach, bristle, sliders, twist0, c, out)
            y1[:] = y + h * c
            if motion.shape[0] > 0:
                motor_at(motion, k, (i + 1.0) / STEPS, y1)
            rates(t, h, y1, torque, p, table, reach, bristle, sliders, twist0, d, out)
            middle = 0.5 * y[1]
            y += h / 6 * (a + 2 * b + 2 * c + d)
            if motion.shape[0] > 0:
                motor_at(motion, k, (i + 1.0) / STEPS, y)
            middle += 0.5 * y[1]
            if p.bristle > 0:
                bristle, _ = bristle_after(bristle, middle, h, p)
            if p.maxwell > 0:
                rates(t, 0.0, y, torque, p, table, reach, bristle, sliders, twist0, a, out)
                for j in range(SLIDERS):
                    share, far = slider(j, p)
                    sliders[j] = slipped(sliders[j], out[1] - twist0, share, far, p)
                twist0 = out[1]
            t += h


@njit(cache=True)
def balance(p, angle, table, reach):
    """Output angle, housing angle and motor torque at rest under the load, where the log begins."""
    if p.locked:
        return np.zeros(3)
    motor, output, housing = p.ratio * angle, angle, 0.0
    for _ in range(30):
        load = load_at(output, p)
        low, high = -reach, reach
        for _ in range(60):
            middle = 0.5 * (low + high)
            pull = spring_torque(middle, table, reach, p) + uneven_at(motor, p)[0] * middle
            low, high = (middle, high) if pull < load else (low, middle)
        housing = -(1.0 - 1.0 / p.ratio) * load * p.mount
        error, by_m, _ = error_of(motor, output, p)
        output = motor / p.ratio + error + (1.0 - 1.0 / p.ratio) * housing - 0.5 * (low + high)
    return np.array([output, housing, load * (1.0 / p.ratio + by_m)])


def simulate(
    p: Numbers, angle: np.ndarray, speed: np.ndarray, motion: np.ndarray | None = None
) -> np.ndarray:
    """Motor angle and torque, output angle and torque, temperature, motor speed and acceleration.

    Args:
        p: the plant.
        angle: reference at the output, rad, shape (n,) at the controller's rate.
        speed: its derivative.
        motion: motor angle, speed and acceleration that are prescribed instead of controlled, shape (n, 3).

    Returns:
        What is true, without sensors, shape (n, 7).
    """
    table, reach = spring_table(p)
    inertia = p.motor_inertia + (0.0 if p.locked else p.load_inertia / p.ratio**2)
    # Against a locked output the position loop has to beat the spring.
    gain, place = (600.0 * inertia, 60.0) if p.locked else (170.0 * inertia, 25.0)
    limit = 2.0 * p.t2 / abs(p.ratio)
    log = np.zeros((len(angle), 7))
    if p.mount > 0 and p.mount_inertia == 0:
        p = p._replace(mount=0.0)
    given = np.zeros((0, 3)) if motion is None else np.ascontiguousarray(motion)
    start = balance(p, float(angle[0]), table, reach)
    integrate(angle, speed, given, start, p, table, reach, np.array([gain, 40 * gain, place, limit]), log)
    if not np.all(np.isfinite(log)):
        raise FloatingPointError("the plant has run away")
    return log
