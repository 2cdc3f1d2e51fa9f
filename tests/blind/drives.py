"""Six drives of different size, with the model that the diagnosis is given of each.

The numbers are those of plausible machines around catalogued sizes (stiffness from 3.4e3 to 2.5e5 N m/rad,
ratios from -160 to -50, and +101 with the circular spline as output); the sensors' noise scales with them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Drive:
    """Nominal numbers, SI units, motor-side friction and inertia at the motor shaft."""

    name: str
    flexspline_teeth: int
    stiffness: tuple[float, float, float]
    torques: tuple[float, float]
    motor_inertia: float
    load_inertia: float
    damping: float
    coulomb: float
    viscous: float
    load_loss: float
    arm: float  # N m, weight times lever of the arm, where the load is one
    top_speed: float  # rad/s of the motor
    circular_spline_output: bool = False
    output_noise: float = 4e-6  # rad
    motor_noise: float = 4e-5  # rad

    @property
    def ratio(self) -> float:
        """Motor angle over output angle, signed."""
        if self.circular_spline_output:
            return (self.flexspline_teeth + 2) / 2
        return -self.flexspline_teeth / 2

    @property
    def motor_torque_noise(self) -> float:
        """Standard deviation at the motor shaft, N m."""
        return 0.2 * self.coulomb

    @property
    def output_torque_noise(self) -> float:
        """Standard deviation of the joint's torque sensor, N m."""
        return 0.02 * self.torques[0]


DRIVES = (
    Drive("size 20, -100", 200, (1.6e4, 2.5e4, 2.9e4), (7.0, 25.0), 6.93e-5, 0.5, 8.0, 0.03, 3.5e-4, 0.06,
          12.0, 90.0),
    Drive("size 14, -50", 100, (3.4e3, 4.7e3, 5.7e3), (2.0, 6.9), 1.4e-5, 0.035, 0.6, 0.012, 9e-5, 0.08,
          2.6, 75.0, output_noise=1e-5),
    Drive("size 17, -80", 160, (1.0e4, 1.4e4, 1.6e4), (3.9, 12.0), 3.3e-5, 0.15, 3.0, 0.02, 2e-4, 0.07,
          6.0, 90.0, output_noise=6e-6),
    Drive("size 25, -120", 240, (3.1e4, 5.0e4, 5.7e4), (14.0, 48.0), 1.6e-4, 1.6, 15.0, 0.045, 6e-4, 0.05,
          25.0, 100.0),
    Drive("size 32, +101", 200, (6.7e4, 1.1e5, 1.2e5), (29.0, 108.0), 5.0e-4, 5.0, 40.0, 0.08, 1.2e-3, 0.09,
          60.0, 80.0, circular_spline_output=True),
    Drive("size 40, -160", 320, (1.3e5, 2.1e5, 2.5e5), (54.0, 196.0), 1.2e-3, 12.0, 90.0, 0.13, 2.2e-3, 0.06,
          130.0, 110.0, output_noise=3e-6),
)  # fmt: skip

#: Factors on a drive's inertia, stiffness and friction numbers.
LEAST_FACTOR, MOST_FACTOR = 0.6, 1.7


def around(drive: Drive, draws: tuple[float, ...]) -> Drive:
    """Another drive of the same size.

    Args:
        drive: the middle.
        draws: eight, uniform in 0 to 1.
    """
    f = [LEAST_FACTOR * (MOST_FACTOR / LEAST_FACTOR) ** draw for draw in draws]
    k1, k2, k3 = drive.stiffness
    return replace(
        drive,
        stiffness=(k1 * f[0], k2 * f[0], k3 * f[0]),
        motor_inertia=drive.motor_inertia * f[1],
        load_inertia=drive.load_inertia * f[2],
        damping=drive.damping * f[3],
        coulomb=drive.coulomb * f[4],
        viscous=drive.viscous * f[5],
        load_loss=drive.load_loss * f[6],
        arm=drive.arm * f[7],
    )


#: Speed over which the sign of Coulomb friction is smoothed, rad/s of the motor: moving, output locked.
SIGN_SPEED, LOCKED_SIGN_SPEED = 0.5, 0.05
#: Distance of the arm's centre of mass, m.
LEVER = 0.3
GRAVITY = 9.80665


def base_yaml(drive: Drive, *, gravity: bool, locked: bool, lacks: tuple[str, ...] = ()) -> str:
    """The model that the diagnosis is given.

    Args:
        drive: the nominal numbers.
        gravity: whether the load is an arm.
        locked: whether the output is locked.
        lacks: numbers of the friction that the model hasn't: ``coulomb``, ``viscous``, ``load_loss``.
    """
    k1, k2, k3 = drive.stiffness
    t1, t2 = drive.torques
    teeth = drive.flexspline_teeth
    friction = {
        "coulomb_nm": 0.0 if "coulomb" in lacks else drive.coulomb,
        "viscous_nm_s_per_rad": 0.0 if "viscous" in lacks else drive.viscous,
        "load_coefficient": 0.0 if "load_loss" in lacks else drive.load_loss,
        "smoothing_velocity_rad_per_s": LOCKED_SIGN_SPEED if locked else SIGN_SPEED,
    }
    lines = [
        "name: blind bench",
        "description: The model that a blind plant is held against.",
        "drive:",
        f"  rated_torque_nm: {t2 * 2:.8g}",
        f"  arrangement: {'flexspline_fixed' if drive.circular_spline_output else 'circular_spline_fixed'}",
        f"  geometry: {{flexspline_teeth: {teeth}, circular_spline_teeth: {teeth + 2}}}",
        "  torsion:",
        f"    stiffness_k1_nm_per_rad: {k1:.8g}",
        f"    stiffness_k2_nm_per_rad: {k2:.8g}",
        f"    stiffness_k3_nm_per_rad: {k3:.8g}",
        f"    torque_t1_nm: {t1:.8g}",
        f"    torque_t2_nm: {t2:.8g}",
        f"    damping_nm_s_per_rad: {drive.damping:.8g}",
        f"  inertia: {{motor_kg_m2: {0.75 * drive.motor_inertia:.8g}, "
        f"wave_generator_kg_m2: {0.25 * drive.motor_inertia:.8g}}}",
        "  friction:",
        *(f"    {name}: {value:.8g}" for name, value in friction.items()),
        "  mesh: {model: lumped}",
        "command:",
        "  motor: {type: free}",
        *(["  output: {type: locked}"] if locked else []),
        "load:",
        f"  inertia_kg_m2: {drive.load_inertia:.8g}",
    ]
    if gravity and not locked:
        mass = drive.arm / (GRAVITY * LEVER)
        lines.append(f"  gravity: {{mass_kg: {mass:.10g}, centre_of_mass_m: {LEVER}}}")
    return "\n".join([*lines, "run: {duration_s: 1.0}", ""])
