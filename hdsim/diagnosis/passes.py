"""What a search goes through and comes to: its passes, the names, the last fit."""

from __future__ import annotations

from dataclasses import dataclass, field

from hdsim.diagnosis.locate import Location
from hdsim.diagnosis.name import Named
from hdsim.diagnosis.screen import Residual
from hdsim.diagnosis.traces import Screening
from hdsim.estimate.fit import Fit


@dataclass
class Stage:
    """One pass of locate and name."""

    title: str
    location: Location
    power: float
    screening: Screening | None = None
    named: Named | None = None
    over_given: list[tuple[Named, Screening]] | None = field(default=None, repr=False)


@dataclass
class Search:
    """What a search found: its passes, the effects in the order of ``fit.state.added``, the last fit.

    ``better`` is the base without effects where its own numbers explain what the only one was given for.
    Where it has done enough and not all is explained, it has ``ended``; what is left may be no more than what
    the motion's noise makes of a model as ``sensitive``. All begins ``anew`` where a vibration
    at the beginning of a record, or a shaft that sticks, was behind the first effects: it counts no more.
    What explains all that is left then is ``kept``. Of ``asked``, a fit, it is known that neither was.
    """

    fit: Fit
    left: Residual
    stages: list[Stage] = field(default_factory=list)
    named: list[Named] = field(default_factory=list)
    better: Fit | None = None
    thorough: bool = False
    earlier: Fit | None = None
    ended: bool = False
    sensitive: bool = False
    anew: bool = False
    kept: bool = False
    asked: Fit | None = None
