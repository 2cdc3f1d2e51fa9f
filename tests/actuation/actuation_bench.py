"""A small model to try parts on: a rigid drive whose elements are called as the assembly calls them."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import numpy as np
from numba import njit

from hdsim import kernel as k
from hdsim._abi import call_element

SIGNALS_AT = k.OWN + 8


@njit
def _call(address, inputs, parameters, own, outputs, jacobian):
    call_element(address, inputs, parameters, own, len(inputs), outputs, jacobian)


class Bench:
    """A builder and, when built, the rigid drive theta_m = ratio theta_l (or two loose bodies)."""

    def __init__(self, ratio=-100.0, rated_torque_nm=40.0):
        self.ratio, self.rated_torque_nm, self.seed = ratio, rated_torque_nm, 0
        self.elements, self.states, self.signals = [], [], []

    def element(self, kernel, parameters, *, states=(), last=False):
        own = k.OWN + len(self.states)
        self.elements.append((kernel, np.array(parameters, dtype=float), own))
        self.states += states
        return own

    def signal(self, signal):
        self.signals.append(signal)
        return SIGNALS_AT + 4 * (len(self.signals) - 1)

    @property
    def width(self):
        return SIGNALS_AT + 4 * len(self.signals)

    def call(self, inputs):
        outputs = np.zeros(k.OWN + len(self.states))
        jacobian = np.zeros((len(outputs), len(inputs)))
        for kernel, parameters, own in self.elements:
            _call(kernel.address, inputs, parameters, own, outputs, jacobian)
        return outputs, jacobian

    def inputs(self, t, inside, motor=(0.0, 0.0), output=(0.0, 0.0), states=()):
        x = np.zeros(self.width)
        x[[k.MOTOR_ANGLE, k.MOTOR_VELOCITY]] = motor
        x[[k.OUTPUT_ANGLE, k.OUTPUT_VELOCITY]] = output
        x[k.OWN : k.OWN + len(states)] = states
        for n, signal in enumerate(self.signals):
            at = SIGNALS_AT + 4 * n
            x[at : at + 4] = signal.values([t], [inside])[:, 0]
        return x

    def simulate(self, inertia, times, *, rtol=1e-10):
        """Rigid drive of ``inertia`` (kg m^2, at the motor): motor angle and velocity, and states."""
        from scipy.integrate import solve_ivp

        corners = np.unique(np.concatenate([s.corners(times[0], times[-1]) for s in self.signals]))
        edges = np.concatenate([[times[0]], corners, [times[-1]]])
        y = np.zeros(2 + len(self.states))
        result = np.zeros((len(y), len(times)))
        for start, end in itertools.pairwise(edges):
            middle = 0.5 * (start + end)

            def rate(t, y, middle=middle):
                x = self.inputs(t, middle, y[:2], y[:2] / self.ratio, y[2:])
                out, _ = self.call(x)
                torque = out[k.MOTOR_TORQUE] + out[k.OUTPUT_TORQUE] / self.ratio
                return np.concatenate([[y[1], torque / inertia], out[k.OWN :]])

            inside = (times >= start) & (times <= end)
            solution = solve_ivp(rate, (start, end), y, "DOP853", rtol=rtol, atol=1e-13, dense_output=True)
            result[:, inside] = solution.sol(times[inside])
            y = solution.y[:, -1]
        return SimpleNamespace(angle=result[0], velocity=result[1], states=result[2:])


def jacobian_error(bench, inputs, step=1e-6):
    """Largest relative difference between the kernels' Jacobian and central differences, and the Jacobian."""
    unread = (k.STORED, k.INPUT_FRICTION, k.COMMANDED_TORQUE, k.LOAD_TORQUE)
    read = [row for row in range(k.OWN + len(bench.states)) if row not in unread]
    _, exact = bench.call(inputs)
    worst = 0.0
    for column in range(len(inputs)):
        h = step * max(1.0, abs(inputs[column]))
        up, down = inputs.copy(), inputs.copy()
        up[column] += h
        down[column] -= h
        difference = (bench.call(up)[0] - bench.call(down)[0]) / (2.0 * h)
        scale = np.maximum(1.0, np.abs(exact[:, column]))
        worst = max(worst, float(np.max((np.abs(difference - exact[:, column]) / scale)[read])))
    return worst, exact
