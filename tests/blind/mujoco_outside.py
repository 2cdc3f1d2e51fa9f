"""What is hidden in the MuJoCo plants and was in no catalogue when it was first drawn.

What has a name since (``accepted``) is drawn as before and counts as that effect.
"""

from __future__ import annotations

from mujoco_effects import Hidden

#: Not in the catalogue, but for what has ``accepted`` names.
OUTSIDE = (
    Hidden(
        "end stop",
        lambda d, r, x, same: {"stop": d.stiffness[0] * 0.002 * x, "stop_at": 0.1 + 0.3 * r[0]},
        motions=("multisine", "moves", "plateaus"),
        rigid=True,
        most=200,
    ),
    Hidden(
        "cable",
        lambda d, r, x, same: {
            "cable": 0.2 * d.torques[0] * x,
            "cable_at": 0.8 * r[0] - 0.4,
            "cable_width": 0.1 + 0.2 * r[1],
        },
        rigid=True,
        most=20,
    ),
    Hidden(
        "churning drag",
        lambda d, r, x, same: {"drag": d.coulomb / d.top_speed**2 * x},
        accepted=("nonlinear_viscous_friction",),
        numbers=lambda d, c: {"drag_nm": c["drag"] * 1e4, "speed_exponent": 2.0},
        motions=("multisine", "moves", "plateaus"),
        rigid=True,
        most=15,
    ),
    Hidden(
        "sticky zone",
        lambda d, r, x, same: {
            "sticky": 0.7 * d.coulomb * x,
            "sticky_at": 0.6 * r[0] - 0.3,
            "sticky_width": 0.08 + 0.1 * r[1],
        },
        rigid=True,
        most=8,
    ),
    Hidden(
        "slow drift",
        lambda d, r, x, same: {"drift": 0.7 * d.coulomb * x, "drift_rate": 0.4 + r[0]},
        rigid=True,
        most=10,
    ),
    Hidden(
        "spring catch",
        lambda d, r, x, same: {
            "detent": 0.2 * d.torques[0] * x,
            "detent_at": 0.6 * r[0] - 0.3,
            "detent_width": 0.05 + 0.06 * r[1],
        },
        rigid=True,
        most=15,
    ),
)
