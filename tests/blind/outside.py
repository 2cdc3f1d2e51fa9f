"""What is hidden in plants and has no name in the catalogue: ``unknown`` is the right answer.

What has a name since it was first drawn (``accepted``) is drawn as before and counts as that effect.
"""

from __future__ import annotations

import math

import builders
from hidden import Hidden

#: Not in the catalogue, but for what has ``accepted`` names. ``fixed`` places in the range of every motion.
OUTSIDE = (
    Hidden(
        "spring catch",
        lambda d, r, x, same: {
            "catch": 0.1 * d.torques[0] * x,
            "catch_at": builders.between(0.15, 0.4, r[0]),
            "catch_width": 0.06,
        },
        most=20,
        limit="2 T1",
    ),
    Hidden(
        "cable",
        lambda d, r, x, same: {
            "cable": 0.1 * d.torques[0] * x,
            "cable_at": builders.between(0.05, 0.2, r[0]),
            "cable_width": 0.25,
        },
        most=40,
        limit="4 T1",
    ),
    Hidden(
        "drifting torque",
        lambda d, r, x, same: {"drift": d.coulomb * x},
        most=10,
        limit="10 times the Coulomb friction",
    ),
    Hidden(
        "churning",
        lambda d, r, x, same: {"churn": 0.5 * d.coulomb / d.top_speed**2 * x},
        accepted=("nonlinear_viscous_friction",),
        expected=lambda d, c: {"drag_nm": c["churn"] * 1e4, "speed_exponent": 2.0},
        most=6,
        limit="3 times the Coulomb friction at top speed",
    ),
    Hidden(
        "cogging of the load",
        lambda d, r, x, same: {
            "cogging": 0.05 * d.torques[0] * x,
            "cogging_order": float(7 + 2 * int(3 * r[0])),
        },
        most=40,
        limit="2 T1",
    ),
    Hidden(
        "spring-mounted mass on the output",
        lambda d, r, x, same: {
            "absorber_inertia": 0.05 * d.load_inertia * x,
            "absorber": 0.05 * d.load_inertia * x * (2 * math.pi * builders.between(2.5, 6.0, r[0])) ** 2,
        },
        most=10,
        limit="half the load's inertia",
        motions=("moves", "chirp", "multisine"),
    ),
    Hidden(
        "friction in a zone of the output",
        lambda d, r, x, same: {
            "zone": d.coulomb * x,
            "zone_at": builders.between(0.1, 0.3, r[0]),
            "zone_width": 0.1,
        },
        most=6,
        limit="6 times the Coulomb friction",
    ),
    Hidden(
        "dragging brake",
        lambda d, r, x, same: {"brake": d.coulomb * x},
        most=6,
        limit="6 times the Coulomb friction",
    ),
    Hidden(
        "saturating motor",
        lambda d, r, x, same: {"saturation": 0.3 * x},
        most=3,
        arm=True,
        limit="torque constant down by 47 % at T2",
    ),
)
