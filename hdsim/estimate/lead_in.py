"""How a prediction begins: in balance with the load that its record begins with.

Before the record the motion goes on at its first speed, and nobody knows how the load came to where it is. A
load that is set free at no twist falls into it and swings about it for as long as the drive's own damping,
which is a guess, lets it: an arm that is held level would swing for seconds by some of its wind-up, which no
record shows that began at rest. So for the time of the lead-in a damper lies between the output and the motor
behind an ideal gear, critical at first (M. Geradin and D. Rixen, *Mechanical Vibrations*, 3rd ed., Wiley
2015, section 1.2) and gone at its end. It takes no torque where output and motor turn alike, so the balance
that the load settles into is the model's own, through gaps and loops too.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdsim.drive.parameters import Drive
    from hdsim.parts import Builder


class LeadInDamper:
    """Damper between the output and an ideal gear's, before a record begins.

    Args:
        drive: whose torsion carries the load.
        inertia_kg_m2: of the load.
        ends_s: time at which it is gone.
        ratio: signed ratio of the gear.
    """

    def __init__(self, drive: Drive, inertia_kg_m2: float, ends_s: float, ratio: float) -> None:
        critical = 2.0 * math.sqrt(drive.torsion.stiffness_k1_nm_per_rad * inertia_kg_m2)
        self.numbers = [critical, ends_s, 1.0 / ratio]

    def contribute(self, build: Builder) -> None:
        """Add the damper's torque."""
        from hdsim.estimate._lead_in_kernel import lead_in_damper

        build.element(lead_in_damper, self.numbers)
