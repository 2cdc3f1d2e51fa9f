"""Initial-value problems with known solutions, as system kernels: every method is checked on every one.

Each class has ``name``, ``t_end`` (s), ``system()`` and ``exact(t)`` -> states (n, m). ``system().scale``
is the size of each state, so the error that counts is ``abs(y - exact) / scale``. ``smooth`` is False where
the right-hand side has kinks: there no method keeps its order, the error control alone keeps the tolerance.
"""

import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from hdsim.kernel import system as system_kernel
from hdsim.system import System

NO_INTEGERS = np.zeros(1, dtype=np.int64)


def _system(kernel, reals, y0, scale, quadratures=0):
    return System(
        kernel,
        NO_INTEGERS,
        np.array(reals, float),
        1,
        np.array(y0, float),
        quadratures,
        np.array(scale, float),
    )


@system_kernel
def _free_dead_zone(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """x'' = -w^2 dz(x): reals w, b."""
    w, b = reals[0], reals[1]
    stretch, slope = 0.0, 0.0
    if y[0] > b:
        stretch, slope = y[0] - b, 1.0
    elif y[0] < -b:
        stretch, slope = y[0] + b, 1.0
    dy[0] = y[1]
    dy[1] = -w * w * stretch
    if want != 0:
        jacobian[0] = 0.0
        jacobian[1] = 1.0
        jacobian[2] = -w * w * slope
        jacobian[3] = 0.0
        dfdt[0] = 0.0
        dfdt[1] = 0.0


class FreeDeadZone:
    """Undamped mass on a spring behind a gap: half sines outside, uniform motion inside.

    From rest at b + a the period is 2 pi / w + 4 b / (a w).
    """

    name = "free dead-zone oscillator"
    smooth = False
    w, b, a = 30.0, 0.4, 1.0
    t_end = 1.5

    def system(self):
        return _system(_free_dead_zone, [self.w, self.b], [self.b + self.a, 0.0], [1.4, self.a * self.w])

    def exact(self, t):
        w, a, b = self.w, self.a, self.b
        quarter, gap = math.pi / (2 * w), 2 * b / (a * w)
        half = 2 * quarter + gap
        turns, s = np.divmod(t, half)
        sign = np.where(turns % 2 == 0, 1.0, -1.0)
        first, last = s < quarter, s >= quarter + gap
        late = w * (s - quarter - gap)
        x = np.where(
            first, b + a * np.cos(w * s), np.where(last, -b - a * np.sin(late), b - a * w * (s - quarter))
        )
        v = np.where(first, -a * w * np.sin(w * s), np.where(last, -a * w * np.cos(late), -a * w))
        return np.array([sign * x, sign * v])


@system_kernel
def _two_mass(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """Two inertias on a damped spring and the energy that it dissipates: reals j1, j2, k, c."""
    j1, j2, k, c = reals[0], reals[1], reals[2], reals[3]
    torque = k * (y[0] - y[1]) + c * (y[2] - y[3])
    dy[0] = y[2]
    dy[1] = y[3]
    dy[2] = -torque / j1
    dy[3] = torque / j2
    dy[4] = c * (y[2] - y[3]) ** 2
    if want != 0:
        for i in range(25):
            jacobian[i] = 0.0
        for i in range(5):
            dfdt[i] = 0.0
        jacobian[2] = 1.0
        jacobian[8] = 1.0
        for row in range(2):
            factor = -1.0 / j1 if row == 0 else 1.0 / j2
            jacobian[10 + 5 * row] = factor * k
            jacobian[11 + 5 * row] = -factor * k
            jacobian[12 + 5 * row] = factor * c
            jacobian[13 + 5 * row] = -factor * c
        jacobian[22] = 2.0 * c * (y[2] - y[3])
        jacobian[23] = -2.0 * c * (y[2] - y[3])


class TwoMassResonance:
    """Free, damped vibration of two inertias on a spring, with the dissipated energy as a quadrature.

    Modal solution: the centre of inertia moves uniformly, the twist is a damped oscillator of the reduced
    inertia. The dissipated energy is what the twist has lost.
    """

    name = "two-mass resonance"
    smooth = True
    j1, j2, k, c = 0.2, 1.0, 1000.0, 1.5
    twist0, speed0 = 0.02, 0.5
    t_end = 0.4

    def system(self):
        share = self.j2 / (self.j1 + self.j2)
        y0 = [share * self.twist0, (share - 1.0) * self.twist0, self.speed0, self.speed0, 0.0]
        return _system(
            _two_mass, [self.j1, self.j2, self.k, self.c], y0, [0.02, 0.02, 1.0, 1.0, 0.2], quadratures=1
        )

    def exact(self, t):
        share = self.j2 / (self.j1 + self.j2)
        reduced = self.j1 * share
        decay = self.c / (2 * reduced)
        w = math.sqrt(self.k / reduced - decay**2)
        twist = self.twist0 * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
        rate = -self.twist0 * np.exp(-decay * t) * (w + decay**2 / w) * np.sin(w * t)
        lost = 0.5 * self.k * (self.twist0**2 - twist**2) - 0.5 * reduced * rate**2
        centre = self.speed0 * t
        return np.array(
            [
                centre + share * twist,
                centre + (share - 1.0) * twist,
                self.speed0 + share * rate,
                self.speed0 + (share - 1.0) * rate,
                lost,
            ]
        )


@system_kernel
def _duffing(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """x'' = -a x - b x^3 and the work of the spring: reals a, b."""
    a, b = reals[0], reals[1]
    dy[0] = y[1]
    dy[1] = -a * y[0] - b * y[0] ** 3
    dy[2] = dy[1] * y[1]
    if want != 0:
        slope = -a - 3.0 * b * y[0] ** 2
        for i in range(9):
            jacobian[i] = 0.0
        for i in range(3):
            dfdt[i] = 0.0
        jacobian[1] = 1.0
        jacobian[3] = slope
        jacobian[6] = slope * y[1]
        jacobian[7] = dy[1]


class Duffing:
    """Mass on a hardening cubic spring, from rest at A: x = A cn(w t | m), Abramowitz & Stegun ch. 16.

    w^2 = a + b A^2, m = b A^2 / (2 w^2). The work of the spring is the kinetic energy, a quadrature.
    """

    name = "hardening spring"
    smooth = True
    a, b, amplitude = 1.0, 4.0, 1.0
    t_end = 6.0

    def system(self):
        return _system(_duffing, [self.a, self.b], [self.amplitude, 0.0, 0.0], [1.0, 2.0, 2.0], quadratures=1)

    def exact(self, t):
        w = math.sqrt(self.a + self.b * self.amplitude**2)
        m = self.b * self.amplitude**2 / (2 * w * w)
        sn, cn, dn, _ = ellipj(np.mod(w * t, 4 * ellipk(m)), m)
        v = -self.amplitude * w * sn * dn
        return np.array([self.amplitude * cn, v, 0.5 * v**2])


@system_kernel
def _coulomb_tanh(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """v' = -a tanh(v / s), x' = v: reals a, s."""
    a, s = reals[0], reals[1]
    level = math.tanh(y[1] / s)
    dy[0] = y[1]
    dy[1] = -a * level
    if want != 0:
        jacobian[0] = 0.0
        jacobian[1] = 1.0
        jacobian[2] = 0.0
        jacobian[3] = -a * (1.0 - level * level) / s
        dfdt[0] = 0.0
        dfdt[1] = 0.0


class CoulombStop:
    """A body slowed down by friction a tanh(v / s) until it stands: sinh(v / s) = sinh(v0 / s) exp(-a t / s).

    This, and not the corner of the sign function, is the exact solution of what is integrated. The angle is
    its integral, by adaptive quadrature. The limit s -> 0 is ``CoulombCorner``.
    """

    name = "Coulomb stop (tanh)"
    smooth = True
    a, s, v0 = 10.0, 0.05, 2.0
    t_end = 0.3

    def system(self):
        return _system(_coulomb_tanh, [self.a, self.s], [0.0, self.v0], [0.2, self.v0])

    def _speed(self, t):
        return self.s * np.arcsinh(np.sinh(self.v0 / self.s) * np.exp(-self.a / self.s * t))

    def exact(self, t):
        stop = self.v0 / self.a
        x = [
            sum(
                quad(self._speed, low, high, epsabs=1e-13, epsrel=1e-13)[0]
                for low, high in ((0.0, min(end, stop)), (min(end, stop), end))
            )
            for end in t
        ]
        return np.array([x, self._speed(np.asarray(t))])


@system_kernel
def _coulomb_sign(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """v' = -a for the sign of speed of this span: reals a, sign."""
    dy[0] = y[1]
    dy[1] = -reals[0] * reals[1]
    if want != 0:
        jacobian[0] = 0.0
        jacobian[1] = 1.0
        jacobian[2] = 0.0
        jacobian[3] = 0.0
        dfdt[0] = 0.0
        dfdt[1] = 0.0


class CoulombCorner:
    """The same body under -a sign(v), piecewise: uniform deceleration to the stop at v0 / a, then rest.

    Not integrated over the corner: the stop is an event and ends the span.
    """

    name = "Coulomb stop (sign)"
    a, v0 = 10.0, 2.0

    def system(self):
        return _system(_coulomb_sign, [self.a, 1.0], [0.0, self.v0], [0.2, self.v0])

    @property
    def stop(self):
        """Time and angle of the stop."""
        return self.v0 / self.a, self.v0**2 / (2 * self.a)


@system_kernel
def _forced_backlash(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """x'' = -2 d x' - w^2 dz(x) + f cos(q t): reals w, b, d, f, q."""
    w, b, d, f, q = reals[0], reals[1], reals[2], reals[3], reals[4]
    stretch, slope = 0.0, 0.0
    if y[0] > b:
        stretch, slope = y[0] - b, 1.0
    elif y[0] < -b:
        stretch, slope = y[0] + b, 1.0
    dy[0] = y[1]
    dy[1] = -2.0 * d * y[1] - w * w * stretch + f * math.cos(q * t)
    if want != 0:
        jacobian[0] = 0.0
        jacobian[1] = 1.0
        jacobian[2] = -w * w * slope
        jacobian[3] = -2.0 * d
        dfdt[0] = 0.0
        dfdt[1] = -f * q * math.sin(q * t)


class ForcedBacklash:
    """Damped oscillator behind a gap under a harmonic force: linear pieces, joined where x crosses a flank.

    Each piece is the forced solution plus the free one that fits its start (the free body's and the
    spring's); brentq finds the crossings.
    """

    name = "forced backlash"
    smooth = False
    w, b, d, f, q = 20.0, 0.05, 2.0, 60.0, 12.0
    x0, v0 = 0.1, 0.0
    t_end = 1.5

    def __init__(self):
        self._pieces = []
        t, x, v = 0.0, self.x0, self.v0
        side = 1
        while t < self.t_end:
            piece = self._piece(t, x, v, side)
            self._pieces.append((t, piece))
            end = None
            grid = t + 1e-9 + np.arange(0.0, self.t_end + 0.01, 2e-4)
            for flank in [self.b, -self.b] if side == 0 else [side * self.b]:
                height = piece(grid)[0] - flank
                # Leaving a flank starts on it: what counts is the first crossing after that.
                crossing = np.flatnonzero(height[:-1] * height[1:] < 0.0)
                if len(crossing):
                    i = crossing[0]
                    root = brentq(
                        lambda s, f=flank, x=piece: x(s)[0] - f, grid[i], grid[i + 1], xtol=1e-15, rtol=1e-15
                    )
                    if end is None or root < end[0]:
                        end = root, flank
            if end is None:
                break
            t, flank = end
            (x, v) = flank, piece(t)[1]
            side = 0 if side != 0 else int(math.copysign(1, flank))

    def _piece(self, start, x, v, side):
        """Solution from (start, x, v) on one flank (+-1) or in the gap (0), as a function of time."""
        stiffness = self.w**2 if side else 0.0
        rest = side * self.b
        response = self.f / (stiffness - self.q**2 + 2j * self.d * self.q)

        def forced(t):
            wave = response * np.exp(1j * self.q * t)
            return rest + wave.real, (1j * self.q * wave).real

        at_start = forced(start)
        x, v, d = x - at_start[0], v - at_start[1], self.d

        def free(s):
            if side:
                w = math.sqrt(stiffness - d * d)
                decay, cos, sin = np.exp(-d * s), np.cos(w * s), np.sin(w * s)
                slope = (v + d * x) / w
                return decay * (x * cos + slope * sin), decay * (
                    (slope * w - d * x) * cos - (x * w + d * slope) * sin
                )
            return x - v * np.expm1(-2 * d * s) / (2 * d), v * np.exp(-2 * d * s)

        return lambda t: np.add(forced(t), free(t - start))

    @property
    def crossings(self):
        """Number of times that x crosses a flank."""
        return len(self._pieces) - 1

    def system(self):
        return _system(
            _forced_backlash, [self.w, self.b, self.d, self.f, self.q], [self.x0, self.v0], [0.3, 5.0]
        )

    def exact(self, t):
        starts = np.array([start for start, _ in self._pieces])
        chosen = np.searchsorted(starts, t, side="right") - 1
        return np.array([self._pieces[i][1](s) for i, s in zip(chosen, t, strict=True)]).T


@system_kernel
def _prothero_robinson(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """y' = l (y - sin t) + cos t: reals l."""
    dy[0] = reals[0] * (y[0] - math.sin(t)) + math.cos(t)
    if want != 0:
        jacobian[0] = reals[0]
        dfdt[0] = -reals[0] * math.cos(t) - math.sin(t)


class ProtheroRobinson:
    """Stiff, linear, driven: y = sin t whatever l (Prothero & Robinson 1974, Math. Comp. 28:145)."""

    name = "Prothero-Robinson"
    smooth = True
    t_end = 1.5

    def __init__(self, rate=-1e4):
        self.rate = rate

    def system(self):
        return _system(_prothero_robinson, [self.rate], [0.0], [1.0])

    def exact(self, t):
        return np.sin(t)[None, :]


@system_kernel
def _driven_decay(t, y, integers, reals, scratch, want, dy, jacobian, dfdt):
    """y' = -2 t y^2, q' = y."""
    dy[0] = -2.0 * t * y[0] * y[0]
    dy[1] = y[0]
    if want != 0:
        jacobian[0] = -4.0 * t * y[0]
        jacobian[1] = 0.0
        jacobian[2] = 1.0
        jacobian[3] = 0.0
        dfdt[0] = -2.0 * y[0] * y[0]
        dfdt[1] = 0.0


class DrivenDecay:
    """Nonlinear and explicitly time-dependent, with a quadrature: y = 1 / (1 + t^2), q = arctan t."""

    name = "driven decay"
    smooth = True
    t_end = 3.0

    def system(self):
        return _system(_driven_decay, [0.0], [1.0, 0.0], [1.0, 1.0], quadratures=1)

    def exact(self, t):
        return np.array([1.0 / (1.0 + t**2), np.arctan(t)])


ALL = [
    FreeDeadZone(),
    TwoMassResonance(),
    Duffing(),
    CoulombStop(),
    ForcedBacklash(),
    ProtheroRobinson(),
    DrivenDecay(),
]
SMOOTH = [TwoMassResonance(), Duffing(), DrivenDecay()]
