"""What in a plant yields: the spring in its parts, and the elements that remember (sliders, bristles)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from plant_numbers import Numbers

SLIDERS = 12
TABLE = 20001  # entries of the spring's table


@njit(cache=True)
def spring_torque(d, table, reach, p):
    """The gap takes its width first, then the table of the springs in series; a cubic is parallel."""
    torque = 0.0
    if p.cubic > 0:
        if p.cubic_form > 0:
            torque = p.cubic * d * d * d
        else:
            # 6 s^3 (sinh(d/s) - d/s) = d^3 + d^5/(20 s^2) + ...
            torque = 6 * p.cubic * p.cubic_scale**3 * (math.sinh(d / p.cubic_scale) - d / p.cubic_scale)
    if p.gap > 0:
        half = 0.5 * p.gap
        if p.gap_rounding > 0:
            s = p.gap_rounding * p.gap
            d += 0.5 * (math.sqrt((d - half) ** 2 + s * s) - math.sqrt((d + half) ** 2 + s * s))
        else:
            d = math.copysign(max(0.0, abs(d) - half), d)
    place = (d / reach + 1.0) * 0.5 * (len(table) - 1)
    k = min(max(int(place), 0), len(table) - 2)
    return torque + table[k] + (place - k) * (table[k + 1] - table[k])


@njit(cache=True)
def bristle_after(z, speed, s, p):
    """Bristle deflection after the time ``s`` at a speed, and the rate at which it relaxes."""
    if p.bristle_form > 0:
        fall = math.exp(-((speed / p.bristle_speed) ** 2))
    else:
        fall = math.exp(-abs(speed / p.bristle_speed))
    level = p.bristle_coulomb + (p.bristle_static - p.bristle_coulomb) * fall
    rate = p.bristle * abs(speed) / level
    if rate * s < 1e-9:
        return z + speed * s, rate
    decay = math.exp(-rate * s)
    return z * decay + speed * (1.0 - decay) / rate, rate


@njit(cache=True)
def slider(k, p):
    """Slip torque and slip twist of a slider: twelve that grow linearly, or three equal ones."""
    if p.maxwell_form > 0:
        if k > 2:
            return 0.0, 1.0
        return p.maxwell / 3.0, (1e-4, 3e-4, 8e-4)[k]
    return p.maxwell * 2.0 * (k + 1) / (SLIDERS * (SLIDERS + 1)), p.maxwell_reach * (k + 1) / SLIDERS


@njit(cache=True)
def slip_slope(force, way, share, far, p):
    """Stiffness of a slider that slips by and by: none at its slip torque, all of it on the way back."""
    if force * way <= 0:
        return share / far
    return share / far * (1.0 - min(1.0, abs(force) / share) ** p.maxwell_power)


@njit(cache=True)
def slipped(force, way, share, far, p):
    """Torque of a slider after a little more twist."""
    if p.maxwell_power == 0 or share == 0:
        return min(share, max(-share, force + share / far * way))
    a = slip_slope(force, way, share, far, p)
    b = slip_slope(force + 0.5 * way * a, way, share, far, p)
    c = slip_slope(force + 0.5 * way * b, way, share, far, p)
    d = slip_slope(force + way * c, way, share, far, p)
    return force + way * (a + 2 * b + 2 * c + d) / 6.0


def spring_table(p: Numbers) -> tuple[np.ndarray, float]:
    """Torque over twist of all compliances in series, and the twist at the table's end."""
    top = 6.0 * p.t2
    torque = np.concatenate([np.linspace(0.0, 0.05 * top, 20000), np.linspace(0.05 * top, top, 20000)[1:]])
    d1, d2 = p.t1 / p.k1, p.t1 / p.k1 + (p.t2 - p.t1) / p.k2
    far = d2 + (top - p.t2) / p.k3
    twist = np.interp(torque, [0.0, p.t1, p.t2, top], [0.0, d1, d2, far])
    if p.flexspline > 0:
        scaled = p.flexspline_coefficient * torque
        if p.flexspline_form > 0:
            twist = twist + p.flexspline / p.flexspline_coefficient * np.arctan(scaled)
        else:
            twist = twist + p.flexspline * torque / np.sqrt(1.0 + scaled**2)
    if p.generator > 0:
        # At the wave generator the compliance is that at the output times the ratio squared.
        scaled = p.generator_coefficient * torque / abs(p.ratio)
        shape = -np.expm1(-scaled) if p.generator_form > 0 else scaled / (1.0 + scaled)
        twist = twist + p.generator * abs(p.ratio) / p.generator_coefficient * shape
    if p.mount > 0 and p.mount_inertia == 0:
        twist = twist + (1.0 - 1.0 / p.ratio) ** 2 * p.mount * torque
    reach = float(twist[-1])
    half = np.interp(np.linspace(0.0, reach, TABLE // 2 + 1), twist, torque)
    return np.concatenate([-half[:0:-1], half]), reach
