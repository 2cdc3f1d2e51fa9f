"""Mappings from what people give: a file, a dictionary, or a mapping."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hdsim.log.mapping import Mapping


def mapping_of(given: str | Path | dict[str, Any] | Mapping) -> Mapping:
    """A mapping from its file, from the same as a dictionary, or as it is.

    Raises:
        hdsim.scenario.ScenarioError: with one line for every mistake.
    """
    if isinstance(given, Mapping):
        return given
    from hdsim.scenario import load_model

    if not isinstance(given, dict):
        return load_model(given, Mapping)
    from hdsim.nested import copied
    from hdsim.scenario.problems import Mark
    from hdsim.scenario.reader import Source
    from hdsim.scenario.validation import build

    return build(Source(copied(given), {(): Mark("mapping")}), Mapping)
