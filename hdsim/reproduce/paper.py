"""What the paper prints, and the constants that it leaves to the reader."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hdsim.contact.parameters import Materials
from hdsim.surface.flank import Flank, corrected_flank, equivalent_surface

if TYPE_CHECKING:
    from hdsim.contact.asperities import AsperityStiffness
    from hdsim.contact.majumdar_bhushan import MajumdarBhushan

CIRCULAR_SPLINE = Flank(2.4272, 1.245e-10)
FLEXSPLINE = Flank(2.643, 1.8648e-10)
AVERAGED = Flank(2.5351, 1.55e-10)

#: Table 4 (second of that number): D, G (m), average backlash (m); None where the cell is empty.
BACKLASH: tuple[tuple[float, float, float | None], ...] = (
    (2.2, 1e-12, 21.15e-6),
    (2.4, 1e-12, 0.32e-6),
    (2.6, 1e-12, 5.13e-9),
    (2.8, 1e-12, 9.42e-11),
    (2.3, 1e-9, None),
    (2.3, 1e-11, 5.15e-6),
    (2.3, 1e-13, 1.29e-6),
    (2.3, 1e-15, 0.33e-6),
)
RATED_TORQUE_NM = 52.0
RATED_FORCE_N = 34.67
STIFFNESS_N_PER_M = 6e7
SECTION_4_FORCE_N = 50.0
TEETH = 200
#: The choice that most rows share: Eq. 1 and 15 print one frequency.
SUM = "sum over all n"
ENGAGED_SHARE = 0.30
PITCH_DIAMETER_M = 0.25e-3 * TEETH
LAG_SPACING_M = 1e-6
SCAN_M = 4e-3
HEIGHT_RESOLUTION_M = 200e-9

#: Hardness of quenched and tempered gear steel, HB 255-410 times 9.81e6, Pa.
PLAUSIBLE_HARDNESS_PA = (2.5e9, 4.0e9)
HARDNESS_PA = 3.0e9
MATERIALS = Materials()
MODULUS = f"reduced modulus {MATERIALS.reduced_modulus_pa:.4g} Pa (steel)"


def summed() -> Flank:
    """The pair with its structure functions added, everything as Eq. 17 and 18 print it."""
    return equivalent_surface(CIRCULAR_SPLINE, FLEXSPLINE, constant="printed")


def mended() -> Flank:
    """The same measured heights with the G that Eq. 1 has for them: the pair of hdsim's default drive."""
    return equivalent_surface(corrected_flank(CIRCULAR_SPLINE), corrected_flank(FLEXSPLINE))


def law(
    flank: Flank,
    hardness_pa: float = HARDNESS_PA,
    asperity_stiffness: AsperityStiffness = "printed",
    *,
    modulus_times: float = 1.0,
) -> MajumdarBhushan:
    """The Majumdar-Bhushan law of a flank, with the default steels or so many times their modulus."""
    import warnings

    from hdsim.contact.law import ValidityWarning
    from hdsim.contact.majumdar_bhushan import MajumdarBhushan

    with warnings.catch_warnings():
        # Only the stiffness without the floor is read here.
        warnings.simplefilter("ignore", ValidityWarning)
        return MajumdarBhushan(
            flank.D,
            flank.G_m,
            modulus_times * MATERIALS.reduced_modulus_pa,
            hardness_pa,
            MATERIALS.softer.poisson_ratio,
            asperity_stiffness,
        )
