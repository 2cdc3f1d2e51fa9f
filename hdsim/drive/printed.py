"""A printed number: its value, where it was found and how directly it was seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Confidence = Literal["read", "copied", "quoted"]
"""How a number came here: ``read`` on the maker's or author's own page; ``copied`` from somebody else's copy
of the maker's page, which was read; ``quoted`` as commonly quoted from the catalogue, not read again."""

ARCMIN = 2.908882086657216e-4
"""One minute of arc, rad."""


@dataclass(frozen=True)
class Source:
    """Where a number was found.

    Args:
        citation: document, page or table.
        confidence: how directly it was seen.
    """

    citation: str
    confidence: Confidence


@dataclass(frozen=True)
class Figure:
    """A number in SI units with its source."""

    value: float
    source: Source
