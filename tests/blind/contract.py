"""What a family of blind plants hands over: a drawn case with its records, its base model and its truth.

A family is a module ``family_NAME`` with one function ``draw(number, seed) -> Case``: everything about the
case follows from the two numbers. It shares no code with what diagnoses; hdsim may be used to write the base
as YAML, and by the family whose plant is hdsim's own toothed drive.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np


class AbsentError(Exception):
    """What a family needs (a package, recordings) is not here; the message says what."""


Kind = Literal["null", "parameter", "effect", "pair", "outside"]


@dataclass(frozen=True)
class Measured:
    """One record as a user would have it: SI units, channel names of the measured-data contract.

    Attributes:
        name: of the record.
        time: shape (n,), s, as stamped.
        channels: shape (n,) each.
        ideal: the same channels without the sensors' noise and quantisation, where the family knows them.
        followed: what the plant itself leaves of each channel when its motor is moved as the readings tell,
            root mean square, where the family asks: no model does better.
    """

    name: str
    time: np.ndarray
    channels: dict[str, np.ndarray]
    ideal: dict[str, np.ndarray] = field(default_factory=dict)
    followed: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A blind case.

    Attributes:
        key: ``family/kind/truth/number/seed``.
        family: of plants.
        kind: what it counts towards.
        truth: for each hidden effect, the catalogue names that are right (empty: nothing, or outside).
        records: what fits may see.
        holdout: separate records with other motions; empty: stretches of ``records`` are held out.
        base: the base scenario as YAML text.
        load: where the load's torque comes from (``None``: the default).
        strength: for each hidden thing, root-mean-square of its trace over the noise, in the channel where
            it shows most, beyond what the base's own numbers can absorb.
        numbers: true values by path (``drive.friction.coulomb_nm``, or a field of the hidden effect) where
            the truth's formula is the catalogue's.
        setup: what was drawn: ``rate_hz``, ``encoder_step_over_noise``, ``sensors`` (``motor``, ``both``,
            ``torque sensor``, ``known load``), ``seconds``, ``records``, ``held`` (``stretches``, ``files``),
            ``motion``, ``temperature`` (bool), ``formula`` (``catalogue``, ``other``), and what the family
            adds.
        without: the same recordings without what was put in, of real machines whose own effects nobody
            knows; a name counts as found when this case does not get it.
    """

    key: str
    family: str
    kind: Kind
    truth: tuple[frozenset[str], ...]
    records: tuple[Measured, ...]
    holdout: tuple[Measured, ...]
    base: str
    load: str | None = None
    strength: tuple[float, ...] = ()
    numbers: dict[str, float] = field(default_factory=dict)
    setup: dict[str, Any] = field(default_factory=dict)
    without: Case | None = None
