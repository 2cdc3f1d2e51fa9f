"""What a diagnosis has found out, as plain data: all that its verdict may rest on, and nothing decided."""

from __future__ import annotations

from hdsim.estimate.found import Part


class PlaceEvidence(Part):
    """How much of a channel's residual is a function of one coordinate."""

    coordinate: str
    """Coordinate, by the name that signatures use."""
    channel: str
    """Channel."""
    share: float
    """Cross-validated share of the channel's residual power."""
    power: float
    """The same in whitened power."""


class CandidateEvidence(Part):
    """One effect that was fitted."""

    name: str
    """Its name in the catalogue."""
    label: str = ""
    """Which of its fittings."""
    screened: float
    """Cross-validated share of the residual that its trace explained on the screen."""
    explained: float
    """Part that its fit explains of what there was to explain: all beyond the noise, or what any fit did."""
    behind: float = 0.0
    """Power that it leaves more than the best, as a part of what the best explains."""
    behind_spread: float = 0.0
    """Standard error of that over blocks of time."""
    numbers: int
    """Free numbers of its fit."""
    at_limit: bool = False
    """Whether one of them stands at the end of its range."""


class StageEvidence(Part):
    """One pass of the search."""

    title: str
    """``refit``, or after which effect."""
    power: float
    """Whitened power of the residual that the pass began with."""
    structured: float
    """Cross-validated share of it that the best coordinate of each channel explains."""
    structured_chance: float
    """Probability to see as much where there is no structure."""
    chance: float = 1.0
    """Probability that the screen finds its best share where nothing is missing."""
    places: list[PlaceEvidence] = []
    """Strongest first."""
    candidates: list[CandidateEvidence] = []
    """Effects that were fitted, the best first."""
    named: str = ""
    """The effect that the pass added."""


class HeldOutEvidence(Part):
    """How much of the change that added effects promise shows on data that no step has seen."""

    slope: float = 1.0
    """Regression of the held-out residual on the promised change: 1 where all of it is there, 0 none."""
    spread: float = 0.0
    """Its standard error over blocks of time: large where the held-out data hardly excite the effects."""


class LawEvidence(Part):
    """One effect that the search has added, with all others beside it."""

    name: str
    """Its name in the catalogue."""
    group: list[str] = []
    """Effects that these data cannot tell from it."""
    chance: float
    """Probability that the search that found it finds as much where nothing is missing."""
    sampled: float
    """Share of resampled records, over blocks of time, in which it or its group is the best."""
    gain: float
    """Part of the first pass's structure that it explained when it was added."""
    needed: float = 1.0
    """Part of what would be missing without it that it explains, all others fitted anew, in the channel where
    that is most."""
    own_left: float = 0.0
    """Structure left in its own coordinate, as a part of that and of what it explains."""
    own_first: bool = True
    """Whether its own coordinate tells more than any other of what is left where it acts."""
    exact: bool = False
    """Whether its formula is exact, as statics are, and may leave nothing there."""
    at_limit: bool = False
    """Whether one of its numbers stands at the end of its range."""
    sharp: bool = False
    """Whether it makes lines in an order spectrum, which no smooth law does."""
    held: HeldOutEvidence | None = None
    """How much of its own change held-out data show beside all others; None: not asked."""


class RestEvidence(Part):
    """The channel that is left with most beyond its noise."""

    record: str
    """Record."""
    channel: str
    """Channel."""
    times_noise: float
    """Root mean square of what is left over that of the noise, over the whole channel."""


class Evidence(Part):
    """All that a verdict may rest on."""

    version: int = 1
    """Version of this layout."""
    stages: list[StageEvidence] = []
    """Passes of the search, in their order."""
    laws: list[LawEvidence] = []
    """Effects that it has added, in the order in which they were found."""
    explained: float = 0.0
    """Part of all structure in the re-fitted model's residual that the added effects explain together."""
    left: float = 0.0
    """Share of the last residual that still is a function of some coordinate."""
    left_chance: float = 1.0
    """Probability to see as much where there is no structure."""
    held: HeldOutEvidence = HeldOutEvidence()
    """What held-out data say of the added effects."""
    changed: HeldOutEvidence = HeldOutEvidence()
    """The same of all that the model as given has been changed by, the re-fit of its numbers included."""
    patterned: float = 1.0
    """Share of the re-fitted model's residual that is structure: what is left of it, and of what the added
    effects explain as much as held-out data do not rule out."""
    rest: RestEvidence | None = None
    """What is left beyond the noise, wherever it lives."""
    rest_before: RestEvidence | None = None
    """The same of the re-fitted model, without the added effects."""
    fell: float = 0.0
    """Largest relative fall of a held-out gap by the re-fit; 0 where all channels together, each in units of
    its noise, are no better for it."""
    moved: list[str] = []
    """Numbers of the base whose interval excludes what the model had."""

    @property
    def pattern_chance(self) -> float:
        """Smallest p-value of what was observed, or of what the search has found."""
        chances = [stage.structured_chance for stage in self.stages]
        return min([*chances, *(law.chance for law in self.laws)], default=1.0)
