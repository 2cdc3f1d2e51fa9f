"""What the user writes: YAML in, checked models out, every mistake with its file and line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hdsim.scenario.problems import ScenarioError

if TYPE_CHECKING:
    from hdsim.scenario.model import Scenario
    from hdsim.scenario.schema import json_schema
    from hdsim.scenario.validation import load_model

__all__ = ["Scenario", "ScenarioError", "json_schema", "load_model"]


def __getattr__(name: str) -> Any:
    # Imported when first used: building the models of all parts takes longer than ``hdsim --help`` may.
    if name in __all__:
        from importlib import import_module

        home = {"Scenario": "model", "json_schema": "schema", "load_model": "validation"}[name]
        return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
