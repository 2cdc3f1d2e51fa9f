"""What the user writes: YAML in, checked models out, every mistake with its file and line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hdsim.scenario.problems import ScenarioError

if TYPE_CHECKING:
    from pathlib import Path

    from hdsim.scenario.model import Scenario
    from hdsim.scenario.schema import json_schema
    from hdsim.scenario.validation import load_model

__all__ = ["Scenario", "ScenarioError", "json_schema", "load_model", "loaded"]


def loaded(scenario: Scenario | str | Path) -> Scenario:
    """A scenario, read from its file where that is given.

    Raises:
        InputError: with one line for every mistake in the file.
    """
    from hdsim.scenario.model import Scenario

    return scenario if isinstance(scenario, Scenario) else Scenario.from_yaml(scenario)


def __getattr__(name: str) -> Any:
    # Imported when first used: building the models of all parts takes longer than ``hdsim --help`` may.
    home = {"Scenario": "model", "json_schema": "schema", "load_model": "validation"}.get(name)
    if home is not None:
        from importlib import import_module

        return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
