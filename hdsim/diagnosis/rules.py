"""The numbers that turn evidence into a verdict: few, each with its meaning and what calibrated it."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from hdsim.estimate.found import Part

#: 65 cases of the families numpy and toothed, 67 added effects (``python tests/blind calibrate``), none of
#: more than 30,000 samples; looked at again with 69 cases of any size, 79 effects, 51 of them right.
BY = "blind cases of seed 2"


def _rule(value: float, unit: str, meaning: str, by: str) -> Any:
    return Field(value, description=meaning, json_schema_extra={"unit": unit, "calibrated_by": by})


class Rules(Part):
    """Rules of ``decide``; the logarithm of the odds that a name is right is a sum over its evidence."""

    chance: float = _rule(
        0.02, "probability", "largest chance at which structure counts as such", "chosen: false alarms"
    )
    odds: float = _rule(-0.28, "log odds", "of a name whose evidence is neutral", BY)
    explained: float = _rule(
        1.94, "log odds per log odds", "weight of the part of all structure that the names explain", BY
    )
    explained_even: float = _rule(0.7, "1", "part of the structure at which that is neutral", "chosen")
    explained_most: float = _rule(
        0.5,
        "1",
        "part of the structure below which what is left in other coordinates than a name's counts whole",
        "a principle: more is left than is explained",
    )
    held: float = _rule(
        0.7, "log odds per log odds", "weight of the odds that held-out data give for the effects", BY
    )
    held_mismatch: float = _rule(
        0.25,
        "1",
        "standard deviation of an inexact formula's slope on other motions",
        "chosen",
    )
    held_for: float = _rule(1.5, "log odds", "most that held-out data can say for effects", "chosen")
    held_against: float = _rule(8.0, "log odds", "most that they can say against them", "chosen")
    sampled: float = _rule(0.04, "log odds per log odds", "weight of the share of resampled records won", BY)
    own_left: float = _rule(
        -1.06, "log odds", "for all of the structure in its own coordinate left by a formula", BY
    )
    own_left_exact: float = _rule(
        -40.0,
        "log odds",
        "for all of what an exact formula leaves being structure: a cable is no unbalance",
        "5 % of the first matrix, seeds 100-502",
    )
    exactly: float = _rule(
        0.02,
        "1",
        "part of what an exact formula explains that it may leave in its own coordinate",
        "chosen: as for two effects that count as the same trace; a machine has errors of its own there",
    )
    limit: float = _rule(-3.0, "log odds", "for a number at the end of its range", "chosen")
    later: float = _rule(
        -1.2,
        "log odds",
        "for each effect beside the first",
        "57 later names of blind cases of numpy, toothed and teeth, even seeds 16 to 32, 29 of them right: "
        "likeliest at -1.23, -1.96 to -0.5 within two of the logarithm of the likelihood",
    )
    repeats: float = _rule(
        4.0,
        "standard errors",
        "of a line's slope on held-out data that make it one that is there",
        "chance: 3 in 100,000, with 60 orders in three channels once in 200 records",
    )
    steady: float = _rule(
        20.0,
        "standard errors",
        "of a later effect's slope on held-out data that make them speak for it, whatever it is",
        "34 later names of calibration cases of numpy and toothed, even seeds 22 to 116: right ones have 25 "
        "and more but for three of 26 (5, 13, 18), wrong ones at most 12; later a wrong one had 25",
    )
    needed: float = _rule(
        1.0,
        "log odds per log odds",
        "weight of the part of what would be missing without a later one that it explains",
        BY,
    )
    believed: float = _rule(
        0.5, "probability", "least confidence of a name: more likely right than not", "a principle"
    )
    structured: float = _rule(
        0.12,
        "1",
        "least part of what is left that must be structure to count",
        "blind seeds 100-502 of the first matrix",
    )
    excess: float = _rule(
        0.05,
        "times the noise power of a reading",
        "least excess of the noisiest channel for structure to count",
        "chosen: half of the root mean square of the weakest effects of blind cases",
    )
    rest: float = _rule(1.6, "times the noise", "what may be left without being called unknown", "chosen")
    unknown: float = _rule(
        0.85, "probability", "that what no effect explains is in none of the catalogue's laws", "chosen"
    )
    nothing: float = _rule(0.95, "probability", "that a silent diagnosis has missed nothing", BY)
    fall: float = _rule(0.03, "1", "least relative fall of a held-out gap for a number to be off", "chosen")


RULES = Rules()
