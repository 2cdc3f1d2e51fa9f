"""What belongs to a gear's size and ratio rather than to its series: stiffness, accuracy, inertia.

Sizes 14 to 65, ratio 50 and above. CHA prints sizes 14 to 32, 40, 50 and 58; the others come from the CSF/CSG
catalogue, and where that was cut off, from a copy.
"""

from __future__ import annotations

from hdsim.drive.printed import ARCMIN, Figure, Source
from hdsim.drive.ratings import GEAR_DB, SELECTOR

CHA = Source("Harmonic Drive AG, CHA manual 1018854 08/2018 V03, p. 54, Tables 54.1 to 54.4", "read")
LLC_49 = Source("Harmonic Drive LLC, CSF/CSG catalogue (yumpu 46053898), p. 49, Table 40: standard", "read")
LLC_50 = Source("Harmonic Drive LLC, CSF/CSG catalogue (yumpu 46053898), p. 50, Table 42", "read")
SELECTOR_STIFFNESS = Source(
    "Harmonic Drive AG, torsional stiffness of CSG; AimanHaidar/harmonic-drive-selector "
    "data/reducers_tables.py at e1df012",
    "copied",
)
INERTIA_COMPONENT = Source(
    "Harmonic Drive LLC, CSF rating table, moment of inertia; row copied in a public table-extraction test",
    "copied",
)

#: Sizes that CHA does not print.
_NOT_CHA = (45, 65)

# T1, T2 in N m; K1, K2, K3 in N m/rad at ratio 50 and above it.
_LIMITS: dict[int, tuple[float, float]] = {
    14: (2.0, 6.9), 17: (3.9, 12.0), 20: (7.0, 25.0), 25: (14.0, 48.0), 32: (29.0, 108.0),
    40: (54.0, 196.0), 45: (76.0, 275.0), 50: (108.0, 382.0), 58: (168.0, 598.0), 65: (235.0, 843.0),
}  # fmt: skip
_AT_50: dict[int, tuple[float, float, float]] = {
    14: (3.4e3, 4.7e3, 5.7e3), 17: (8.1e3, 11e3, 13e3), 20: (13e3, 18e3, 23e3), 25: (25e3, 34e3, 44e3),
    32: (54e3, 78e3, 98e3), 40: (100e3, 140e3, 180e3), 45: (150e3, 200e3, 260e3),
    50: (200e3, 280e3, 340e3), 58: (310e3, 440e3, 540e3), 65: (440e3, 610e3, 780e3),
}  # fmt: skip
_ABOVE: dict[int, tuple[float, float, float]] = {
    14: (4.7e3, 6.1e3, 7.1e3), 17: (10e3, 14e3, 16e3), 20: (16e3, 25e3, 29e3), 25: (31e3, 50e3, 57e3),
    32: (67e3, 110e3, 120e3), 40: (130e3, 200e3, 230e3), 45: (180e3, 290e3, 330e3),
    50: (250e3, 400e3, 440e3), 58: (400e3, 610e3, 710e3), 65: (540e3, 880e3, 980e3),
}  # fmt: skip

# Arcmin at ratio 50 and above it.
_ACCURACY: dict[int, tuple[float, float]] = {
    14: (1.2, 1.0), 17: (1.2, 1.0), 20: (1.0, 0.8), 25: (1.0, 0.8), 32: (1.0, 0.8), 40: (0.7, 0.5),
    45: (1.0, 1.0), 50: (0.7, 0.5), 58: (0.7, 0.5), 65: (1.0, 1.0),
}  # fmt: skip

# Of the cup type's wave generator, kg m^2.
_INERTIA: dict[int, tuple[float, Source]] = {
    14: (0.033e-4, INERTIA_COMPONENT), 17: (0.079e-4, INERTIA_COMPONENT), 20: (0.193e-4, GEAR_DB),
    25: (0.413e-4, GEAR_DB), 32: (1.69e-4, SELECTOR), 40: (4.5e-4, SELECTOR), 45: (8.68e-4, SELECTOR),
    50: (12.5e-4, SELECTOR), 58: (27.3e-4, SELECTOR), 65: (46.8e-4, SELECTOR),
}  # fmt: skip


def printed_gear(size: int, ratio: int) -> dict[str, Figure]:
    """Stiffness, accuracy and inertia of a size at a ratio, by the names in ``CatalogueFigures``.

    Args:
        size: 14 to 65.
        ratio: 50 or more.

    Raises:
        KeyError: nothing is on record for this size.
    """
    own = size in _NOT_CHA
    above = ratio > 50
    limits = LLC_50 if own else CHA
    stiffness = SELECTOR_STIFFNESS if own else CHA
    low = LLC_50 if own and not above else stiffness  # the page of the catalogue ends before K3
    k1, k2, k3 = (_ABOVE if above else _AT_50)[size]
    found = {
        "torque_t1": Figure(_LIMITS[size][0], limits),
        "torque_t2": Figure(_LIMITS[size][1], limits),
        "stiffness_k1": Figure(k1, low),
        "stiffness_k2": Figure(k2, low),
        "stiffness_k3": Figure(k3, stiffness),
        "accuracy": Figure(_ACCURACY[size][above] * ARCMIN, LLC_49 if own else CHA),
        "wave_generator_inertia": Figure(*_INERTIA[size]),
    }
    if not own:
        found |= {
            "hysteresis_loss": Figure(ARCMIN, CHA),
            "lost_motion": Figure(ARCMIN, CHA),
            "repeatability": Figure(0.1 * ARCMIN, CHA),
        }
    return found
