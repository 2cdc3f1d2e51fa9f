"""The seed drive in plain numpy: the same equations as the compiled model, written down a second time.

For comparisons of speed, and as an independent check: forces on bodies, tooth by tooth (Newton), where the
compiled code differentiates one potential (Lagrange). Only the contact law, the cup's torque over twist and
the random gaps are shared. Covers a fixed circular spline, ``window`` engagement, a dynamic ring, a kinematic
error and a continuous cascade controller without limit, with a sine as trajectory and as load.
"""

import math
from types import SimpleNamespace

import numpy as np
from scipy.interpolate import PPoly

from hdsim.contact import tabulate
from hdsim.drive import _mesh_layout
from hdsim.drive._quartic import CORNERS


def sine(signal, quantity, unit):
    """Value and first two derivatives of a scenario's sine, in a unit: a function of time."""
    assert signal.type == "sine"
    amplitude = unit * getattr(signal, f"amplitude_{quantity}")
    offset = unit * (getattr(signal, f"offset_{quantity}") or 0.0)
    rate, phase = 2 * math.pi * signal.frequency_hz, math.radians(signal.phase_deg)

    def values(t):
        s, c = math.sin(rate * t + phase), math.cos(rate * t + phase)
        return offset + amplitude * s, amplitude * rate * c, -amplitude * rate * rate * s

    return values


class NumpyDrive:
    """y' = f(t, y) with the states of ``model.system`` in the same order.

    Args:
        scenario: what to simulate.
        model: ``hdsim.simulation.setup.build_model(scenario)``, for the states' order, the gaps and the cup.
    """

    def __init__(self, scenario, model):
        drive, mesh, teeth = scenario.drive, scenario.drive.mesh, model.teeth
        assert drive.arrangement == "circular_spline_fixed"
        assert mesh.engagement.kind == "window"
        assert mesh.ring == "dynamic"
        assert not mesh.gap_along_flank
        self.ratio = drive.ratio
        self.J_m, self.J_f, self.J_o = model.inertias
        self.friction = drive.friction
        self.cup_damping, self.mesh_damping = drive.torsion.damping_nm_s_per_rad, mesh.damping_nm_s_per_rad

        # Teeth.
        count = teeth.count
        self.places = 2 * np.pi * np.arange(count) / count
        self.gaps, self.pitch_errors = teeth.half_gaps_m, teeth.pitch_errors_m
        self.lever = teeth.lever_m
        self.half = mesh.engagement.share * np.pi / 2
        self.edge = mesh.engagement.edge_teeth * np.pi / count
        # Contact: polynomial cells of the force; the energy is their antiderivative.
        table = tabulate(teeth.law, 20 * teeth.rated_tooth_force_n)
        self.step, self.end = table.step_m, table.end_m
        self.end_force, self.end_stiffness = table.end_force_n, table.end_stiffness_n_per_m
        self.force_cells = np.ascontiguousarray(table.coefficients[:, :4])
        self.energy_cells = np.ascontiguousarray(table.coefficients[:, [4, 0, 1, 2, 3]]) / [1, 1, 2, 3, 4]
        # Cup.
        p = teeth.parameters
        at, cells, step = (
            int(p[_mesh_layout.SPRING_AT]),
            int(p[_mesh_layout.SPRING_CELLS]),
            p[_mesh_layout.SPRING_STEP],
        )
        self.corners = p[at : at + 2 * CORNERS].reshape(CORNERS, 2)
        at += 2 * CORNERS
        cup = p[at : at + 5 * cells].reshape(cells, 5)[:, 3::-1].T
        self.straightened_cup = PPoly(cup, step * np.arange(cells + 1))

        # Kinematic error, controller, load.
        effects = scenario.effects.active()
        assert set(effects) <= {"kinematic_error"}
        components = effects["kinematic_error"].components if effects else ()
        self.amplitudes = np.array([c.amplitude for c in components])
        self.orders_m = np.array([0.0 if c.per == "output_turn" else c.order for c in components])
        signs = {"wave_generator_turn": 0.0, "output_turn": 1.0, "relative_turn": -1.0}
        self.orders_o = np.array([signs[c.per] * c.order for c in components])
        self.phases = np.radians([c.phase_deg for c in components])
        motor = scenario.command.motor
        assert motor.at == "output"
        assert motor.feedback == "motor"
        assert motor.torque_limit_nm is None
        assert motor.sample_period_s is None
        self.reference, self.law = sine(motor.trajectory, "deg", math.radians(1.0)), motor.controller
        self.load = sine(scenario.load.torque, "nm", 1.0)

    def cup(self, twist):
        """Torque of the cup (N m) at a twist (rad) from 0 on: a smooth curve, and its corners."""
        beyond = np.maximum(twist - self.corners[:, 0], 0.0)
        return self.straightened_cup(twist) + self.corners[:, 1] @ beyond

    def tooth_forces(self, shift, turn):
        """Sum of the teeth's forces (N), and of their torques by the slope of the arcs' ends (N m).

        Args:
            shift: displacement of the flexspline's teeth against the circular spline's, m.
            turn: angle of the ring from the wave generator's major axis, rad.
        """
        phi = self.places + turn
        phi -= np.pi * np.round(phi / np.pi)
        s = np.clip((self.half + self.edge - np.abs(phi)) / (2 * self.edge), 0.0, 1.0)
        weight = s**3 * (10 + s * (6 * s - 15))
        weight_slope = -np.sign(phi) * 30 * (s * (1 - s)) ** 2 / (2 * self.edge)
        displaced = shift + self.pitch_errors
        depth = np.maximum(np.abs(displaced) - self.gaps, 0.0)
        inside = np.minimum(depth, self.end)
        cell = np.minimum((inside / self.step).astype(int), len(self.force_cells) - 1)
        r, over = inside - cell * self.step, depth - inside
        c0, c1, c2, c3 = self.force_cells[cell].T
        force = c0 + r * (c1 + r * (c2 + r * c3)) + over * self.end_stiffness
        e0, e1, e2, e3, e4 = self.energy_cells[cell].T
        energy = e0 + r * (e1 + r * (e2 + r * (e3 + r * e4)))
        energy += over * (self.end_force + 0.5 * over * self.end_stiffness)
        return np.sum(weight * force * np.sign(displaced)), np.sum(weight_slope * energy)

    def parts(self, t, y):
        """Every torque of the drive at (t, y), by name."""
        i = self.ratio
        motor, motor_v = y[0], y[1]
        ring, ring_v = y[2] + motor / i, y[3] + motor_v / i
        output, output_v = y[4] + motor / i, y[5] + motor_v / i

        arguments = self.orders_m * motor + self.orders_o * output + self.phases
        error = self.amplitudes @ np.sin(arguments)
        slopes = self.amplitudes * np.cos(arguments)
        error_m, error_o = self.orders_m @ slopes, self.orders_o @ slopes

        # Mesh: its twist is what the ring lags behind the wave generator's wish.
        twist = motor / i + error - ring
        twist_rate = (1 / i + error_m) * motor_v + error_o * output_v - ring_v
        total, along = self.tooth_forces(self.lever * twist, ring - motor)
        elastic = self.lever * total
        meshing = elastic + self.mesh_damping * twist_rate
        wound, wound_rate = ring - output, ring_v - output_v
        spring = np.sign(wound) * self.cup(abs(wound))
        cup = spring + self.cup_damping * wound_rate

        # Friction depends on what the drive transmits elastically.
        f = self.friction
        transmitted = spring - elastic * error_o
        size = f.coulomb_nm + f.load_coefficient / abs(i) * abs(transmitted)
        friction = size * np.tanh(motor_v / f.smoothing_velocity_rad_per_s) + f.viscous_nm_s_per_rad * motor_v

        law = self.law
        angle, velocity, acceleration = (i * value for value in self.reference(t))
        wanted = law.position_gain_per_s * (angle - motor) + law.velocity_feedforward * velocity
        integral_rate = law.velocity_integral_gain_nm_per_rad * (wanted - motor_v)
        command = law.velocity_gain_nm_s_per_rad * (wanted - motor_v) + y[6]
        command += law.acceleration_feedforward_nm_s2_per_rad * acceleration
        load = self.load(t)[0]

        return SimpleNamespace(
            motor=command - friction - meshing * (1 / i + error_m) + along,
            ring=meshing - along - cup,
            output=cup - meshing * error_o + load,
            integral_rate=integral_rate,
            supplied=command * motor_v,
            delivered=-load * output_v,
            heat=friction * motor_v + self.mesh_damping * twist_rate**2 + self.cup_damping * wound_rate**2,
        )

    def rhs(self, t, y):
        """Right-hand side, shape (n,)."""
        p = self.parts(t, y)
        motor = p.motor / self.J_m
        return np.array(
            [
                y[1],
                motor,
                y[3],
                p.ring / self.J_f - motor / self.ratio,
                y[5],
                p.output / self.J_o - motor / self.ratio,
                p.integral_rate,
                p.supplied,
                p.delivered,
                p.heat,
            ]
        )


def disagreement(system, plain, points=200, seed=0):
    """Largest relative difference between both right-hand sides at random states, shape (n,).

    Relative to the largest value that a row takes. The states twist mesh and cup independently: on a solution
    the torques on the ring nearly cancel, and only rounding would be compared.
    """
    rng = np.random.default_rng(seed)
    spread = system.scale * np.where(np.arange(system.size) == 0, 100.0, 0.5)
    worst, size = np.zeros(system.size), np.zeros(system.size)
    for _ in range(points):
        t, y = rng.uniform(0.0, 1.0), rng.normal(size=system.size) * spread
        compiled = system.rhs(t, y)
        worst = np.maximum(worst, np.abs(compiled - plain.rhs(t, y)))
        size = np.maximum(size, np.abs(compiled))
    return worst / size
