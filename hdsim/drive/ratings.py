"""What a strain-wave gear may carry, as printed: ratings, speeds, life, ratcheting and buckling torques.

Sizes 14 to 65 of the series CSG (cup, high torque) and SHG (hat, high torque); of CSF (cup) only what could
be read: ratcheting torque, buckling torque and life. Every number has its own source, and what no source
gives is None. A drive is built of ``hdsim.drive.catalogue``; what stands here judges what it is asked to do.
"""

from __future__ import annotations

from dataclasses import dataclass

from hdsim.drive.printed import Figure, Source

LLC_14 = Source(
    "Harmonic Drive LLC, CSF/CSG catalogue (yumpu 46053898), p. 14: ratcheting and buckling torque, life",
    "read",
)
GEAR_DB = Source(
    "Harmonic Drive CSG and SHG (same ratings) data; copied, naming no document, in a robot model's gear_db",
    "copied",
)
PRODUCT_PAGE = Source(
    "harmonicdrive.net, CSG-2UH product page of this size and ratio; copied, with the link, in a repository",
    "copied",
)
PROJECT = Source("Harmonic Drive CSG data of this size and ratio; copied in a public robot project", "copied")
QUOTED = Source("Harmonic Drive LLC, CSF/CSG catalogue, CSG rating table (p. 10), not re-read", "quoted")
LW = Source("Harmonic Drive LLC, SHG/SHF-LW brochure (slideshare 40045331), rating table", "read")
SELECTOR = Source(
    "Harmonic Drive AG, CSG-2UH and SHG-2UH rating tables; AimanHaidar/harmonic-drive-selector "
    "data/reducers_tables.py at e1df012",
    "copied",
)
RATED_SPEED = Source("Harmonic Drive AG, engineering data 1021387 12/2018 V02, p. 32: 2000 rpm", "read")


@dataclass(frozen=True)
class Ratings:
    """What one gear may carry; None where no source gives it.

    Torques in N m at the output, speeds in rpm at the input, life in h.

    Args:
        name: series, size and ratio as in ``csg-20-100``.
        series: ``csg``, ``shg`` or ``csf``.
        size: pitch diameter in tenths of an inch.
        ratio: of the reduction, circular spline fixed.
        rated_torque: at which, with the rated input speed, the wave-generator bearing lives its rated life.
        average_torque: limit of the average load torque.
        repeated_peak_torque: limit of starting and stopping torques.
        momentary_peak_torque: limit of an emergency stop or a collision.
        ratcheting_torque: at which the teeth skip.
        buckling_torque: at which the flexspline folds.
        maximum_input_speed: limit at any moment, with grease.
        average_input_speed: limit of the average.
        rated_input_speed: of the rated torque.
        rated_life: L10 of the wave-generator bearing at rated torque and rated input speed.
    """

    name: str
    series: str
    size: int
    ratio: int
    rated_torque: Figure | None
    average_torque: Figure | None
    repeated_peak_torque: Figure | None
    momentary_peak_torque: Figure | None
    ratcheting_torque: Figure | None
    buckling_torque: Figure | None
    maximum_input_speed: Figure | None
    average_input_speed: Figure | None
    rated_input_speed: Figure
    rated_life: Figure


# Rated, average, repeated peak, momentary peak torque of the CSG series, N m, each with its source. Where the
# copied gear_db contradicts itself or the maker's table as copied elsewhere, that table's value is taken:
# peaks of 17-50 (127 there, which is size 20), average torque of 17-80 (38 for CSG, 39.93 for SHG), peaks of
# 14-100 (the same as 14-80 there). Momentary peaks of sizes 14 and 17 above ratio 50 are the gear's, as for
# SHG; for the housed unit CSG-2UH the table prints 58 and 109 N m with a note that was not seen.
_P, _C, _R, _Q, _S = PRODUCT_PAGE, GEAR_DB, PROJECT, QUOTED, SELECTOR
_SMALL: dict[tuple[int, int], tuple[tuple[float, Source], ...]] = {
    (14, 50): ((7.0, _S), (9.0, _S), (23.0, _S), (46.0, _S)),
    (14, 80): ((10.0, _C), (14.0, _C), (30.0, _C), (61.0, _C)),
    (14, 100): ((10.0, _C), (14.0, _C), (36.0, _S), (70.0, _Q)),
    (17, 50): ((21.0, _C), (34.0, _C), (44.0, _C), (91.0, _S)),
    (17, 80): ((29.0, _C), (35.0, _S), (56.0, _C), (113.0, _C)),
    (17, 100): ((31.0, _C), (51.0, _C), (70.0, _C), (143.0, _C)),
    (17, 120): ((31.0, _C), (51.0, _C), (70.0, _C), (112.0, _Q)),
    (20, 50): ((33.0, _C), (44.0, _C), (73.0, _C), (127.0, _C)),
    (20, 80): ((44.0, _S), (61.0, _S), (96.0, _S), (165.0, _S)),
    (20, 100): ((52.0, _P), (64.0, _P), (107.0, _P), (191.0, _P)),
    (20, 120): ((52.0, _S), (64.0, _S), (113.0, _S), (191.0, _S)),
    (20, 160): ((52.0, _R), (64.0, _S), (120.0, _R), (191.0, _R)),
    (25, 50): ((51.0, _P), (72.0, _P), (127.0, _P), (242.0, _P)),
    (25, 80): ((82.0, _S), (113.0, _S), (178.0, _S), (332.0, _R)),
    (25, 100): ((87.0, _R), (140.0, _S), (204.0, _R), (369.0, _R)),
    (25, 120): ((87.0, _S), (140.0, _S), (217.0, _S), (395.0, _S)),
    (25, 160): ((87.0, _S), (140.0, _S), (229.0, _S), (408.0, _S)),
}

RATIOS = (50, 80, 100, 120, 160)

# Rated, average, repeated peak, momentary peak torque, N m, of CSG and SHG from size 32 on, which are alike.
# The rated torques are read in LW and agree with the copy; the other three are the copy's (SELECTOR).
_LARGE: dict[tuple[int, int], tuple[float, float, float, float]] = {
    (32, 50): (99, 140, 281, 497), (32, 80): (153, 217, 395, 738), (32, 100): (178, 281, 433, 841),
    (32, 120): (178, 281, 459, 892), (32, 160): (178, 281, 484, 892),
    (40, 50): (178, 255, 523, 892), (40, 80): (268, 369, 675, 1270), (40, 100): (345, 484, 738, 1400),
    (40, 120): (382, 586, 802, 1530), (40, 160): (382, 586, 841, 1530),
    (45, 50): (229, 345, 650, 1235), (45, 80): (407, 507, 918, 1651), (45, 100): (459, 650, 982, 2041),
    (45, 120): (523, 806, 1070, 2288), (45, 160): (523, 819, 1147, 2483),
    (50, 80): (484, 675, 1223, 2418), (50, 100): (611, 866, 1274, 2678),
    (50, 120): (688, 1057, 1404, 2678), (50, 160): (688, 1096, 1534, 3185),
    (58, 80): (714, 1001, 1924, 3185), (58, 100): (905, 1378, 2067, 4134),
    (58, 120): (969, 1547, 2236, 4329), (58, 160): (969, 1573, 2392, 4459),
    (65, 80): (969, 1352, 2743, 4836), (65, 100): (1236, 1976, 2990, 6175),
    (65, 120): (1236, 2041, 3263, 6175), (65, 160): (1236, 2041, 3419, 6175),
}  # fmt: skip

# Largest and average input speed, rpm, by size (SELECTOR). The copy's average speeds of SHG belong to two
# columns of the print, of which it mixes one into the other: they are left out.
_SPEEDS: dict[int, tuple[float, float]] = {
    14: (8500, 3500), 17: (7300, 3500), 20: (6500, 3500), 25: (5600, 3500), 32: (4800, 3500),
    40: (4000, 3000), 45: (3800, 3000), 50: (3500, 2500), 58: (3000, 2200), 65: (2800, 1900),
}  # fmt: skip

# Ratcheting torque, N m, by size and the ratios of RATIOS (LLC_14, Tables 4 and 6).
_RATCHETING: dict[str, dict[int, tuple[float | None, ...]]] = {
    "csg": {
        14: (110, 140, 100, None, None),
        17: (190, 260, 200, 150, None),
        20: (280, 450, 330, 310, 280),
        25: (580, 880, 650, 610, 580),
        32: (1200, 1800, 1300, 1200, 1200),
        40: (2300, 3600, 2700, 2400, 2300),
    },
    "csf": {
        14: (88, 110, 84, None, None),
        17: (150, 200, 160, 120, None),
        20: (220, 350, 260, 240, 220),
        25: (450, 680, 500, 470, 450),
        32: (980, 1400, 1000, 980, 980),
        40: (1800, 2800, 2100, 1900, 1800),
        45: (2700, 3900, 3100, 2800, 2600),
        50: (3700, 5400, 4100, 3800, 3600),
        58: (5800, 8200, 6400, 5800, 5600),
        65: (7800, 11000, 9400, 8300, 8000),
    },
    "shg": {},
}

# Buckling torque, N m, by size (LLC_14, Tables 5 and 7).
_BUCKLING: dict[str, dict[int, float]] = {
    "csg": {14: 260, 17: 500, 20: 800, 25: 1700, 32: 3500, 40: 6700},
    "csf": {
        14: 190, 17: 330, 20: 560, 25: 1000, 32: 2200, 40: 4300, 45: 5800, 50: 8000, 58: 12000, 65: 17000,
    },
    "shg": {},
}  # fmt: skip

_AG_32 = Source(
    "Harmonic Drive AG, engineering data 1021387 12/2018 V02, p. 32: L50 50,000 h (CSG, SHG), L10 a fifth",
    "read",
)
_LIFE: dict[str, Figure] = {
    "csg": Figure(10_000.0, LLC_14),
    "csf": Figure(7_000.0, LLC_14),
    "shg": Figure(10_000.0, _AG_32),
}

SERIES = tuple(_LIFE)
"""Series with something on record."""

_TORQUES = ("rated_torque", "average_torque", "repeated_peak_torque", "momentary_peak_torque")


def _torques(series: str, size: int, ratio: int) -> dict[str, Figure | None]:
    if series == "csf":
        return dict.fromkeys(_TORQUES)
    if (size, ratio) in _SMALL:
        return {
            name: Figure(value, source if series == "csg" else SELECTOR)
            for name, (value, source) in zip(_TORQUES, _SMALL[size, ratio], strict=True)
        }
    values = _LARGE[size, ratio]
    return {
        name: Figure(float(value), LW if name == "rated_torque" else SELECTOR)
        for name, value in zip(_TORQUES, values, strict=True)
    }


def _build(series: str, size: int, ratio: int) -> Ratings:
    ratcheting = _RATCHETING[series].get(size, (None,) * len(RATIOS))[RATIOS.index(ratio)]
    buckling = _BUCKLING[series].get(size)
    fastest, average = _SPEEDS[size]
    rated = series != "csf"
    return Ratings(
        name=f"{series}-{size}-{ratio}",
        series=series,
        size=size,
        ratio=ratio,
        **_torques(series, size, ratio),
        ratcheting_torque=None if ratcheting is None else Figure(ratcheting, LLC_14),
        buckling_torque=None if buckling is None else Figure(buckling, LLC_14),
        maximum_input_speed=Figure(fastest, SELECTOR) if rated else None,
        average_input_speed=Figure(average, SELECTOR) if series == "csg" else None,
        rated_input_speed=Figure(2000.0, RATED_SPEED),
        rated_life=_LIFE[series],
    )


def _known() -> dict[str, Ratings]:
    found = {}
    for series in SERIES:
        if series == "csf":
            rows = [
                (size, ratio)
                for size, values in _RATCHETING[series].items()
                for ratio, value in zip(RATIOS, values, strict=True)
                if value is not None
            ]
        else:
            rows = [*_SMALL, *_LARGE]
        for size, ratio in rows:
            one = _build(series, size, ratio)
            found[one.name] = one
    return found


_ALL = _known()


def rated_gears(series: str | None = None) -> tuple[Ratings, ...]:
    """Every gear on record, small sizes first.

    Args:
        series: only this one; all by default.
    """
    return tuple(one for one in _ALL.values() if series in (None, one.series))


def ratings(name: str) -> Ratings:
    """What one gear may carry.

    Args:
        name: as in ``csg-32-100``.

    Raises:
        KeyError: nothing is on record for it.
    """
    return _ALL[name]


def ratings_of_preset(preset: str | None) -> Ratings | None:
    """What the gear of a preset may carry; None where nothing is on record, or the drive is no preset.

    The paper behind ``seed-2021`` (with either roughness) prints geometry and rated torque alone; the rest is
    CSG size 20, ratio 100.

    Args:
        preset: name of a preset, or None.
    """
    if preset is None:
        return None
    return _ALL.get("csg-20-100" if preset.startswith("seed-2021") else preset)


def bearing_life_h(gear: Ratings, average_torque_nm: float, average_input_speed_rpm: float) -> float:
    """Life L10 of the wave-generator bearing, h.

    L = L_n (T_r/T_av)^3 (n_r/n_av): Harmonic Drive LLC, CSF/CSG catalogue, p. 14, Eq. 8; Harmonic Drive AG,
    engineering data 1019659 11/2014, p. 18, Eq. 18.11.

    Args:
        gear: with its rated torque, rated input speed and rated life.
        average_torque_nm: of the load at the output, N m, not negative.
        average_input_speed_rpm: of the wave generator, rpm, not negative.

    Returns:
        Hours at these averages; infinite where either is zero.

    Raises:
        ValueError: no source gives the gear's rated torque.
    """
    if gear.rated_torque is None:
        raise ValueError(f"no source gives the rated torque of {gear.name}")
    if average_torque_nm == 0.0 or average_input_speed_rpm == 0.0:
        return float("inf")
    return (
        gear.rated_life.value
        * (gear.rated_torque.value / average_torque_nm) ** 3
        * (gear.rated_input_speed.value / average_input_speed_rpm)
    )
