"""Step 6, add: a scenario that extends the base with what was found, and runs like any other."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from hdsim.effects._fitting import Ranged
from hdsim.estimate.found import ParameterEstimate
from hdsim.estimate.numbers import Free
from hdsim.estimate.records import Array
from hdsim.estimate.state import Added, State, number_at
from hdsim.nested import merge, put

#: What a scenario that a diagnosis writes is called after its base's name, and what it says of itself.
FOUND = (
    "with what was found",
    "Written by a diagnosis: the base with parameters estimated from measured data, and effects.",
)
#: The same of one that a fit writes.
FITTED = ("fitted", "Written by a fit: the base with parameters estimated from measured data.")


def scenario_text(
    base: Path,
    state: State,
    freedoms: Sequence[Free],
    start: State,
    beside: Path,
    about: tuple[str, str] = FOUND,
) -> str:
    """YAML of the scenario.

    Args:
        base: file of the base scenario.
        state: the fitted model.
        freedoms: the base's numbers as they were.
        start: the base model.
        beside: the directory in which the scenario will stand.
        about: what follows the base's name, and the description.
    """
    from hdsim.scenario.writer import to_yaml

    data: dict[str, Any] = {
        "name": f"{base.stem} {about[0]}"[:200],
        "description": about[1],
        "extends": os.path.relpath(base, beside),
    }
    for path, value in changed_numbers(state, freedoms, start).items():
        put(data, path, value)
    effects: dict[str, Any] = {}
    for added in state.added:
        known = effects.setdefault(added.effect, _lists(start, added.effect))
        merge(known, _all_rounded(added.settings()))
    for channel, gain in state.gains.items():
        if abs(gain - 1.0) > 1e-9:
            put(effects, f"sensors.{channel}.gain_error", _rounded(gain - 1.0))
    if effects:
        merge(data.setdefault("effects", {}), effects)
    return to_yaml(data)


def changed_numbers(state: State, freedoms: Sequence[Free], start: State) -> dict[str, float]:
    """The base's own numbers that a fit moved, by their paths, with six digits."""
    found = {}
    for free in freedoms:
        # A reading has no path: it is the log's, and a gain is written as a sensor's.
        for path in free.paths:
            new, old = number_at(state, path), number_at(start, path)
            if new is not None and old is not None and new != old:
                found[path] = _rounded(new)
    return found


def scenario_changes(state: State, freedoms: Sequence[Free], start: State) -> dict[str, float]:
    """`changed_numbers` by the names of ``Scenario.with_``: ``components[0]`` for ``components.0``."""
    found = changed_numbers(state, freedoms, start)
    return {re.sub(r"\.(\d+)(?=\.|$)", r"[\1]", path): value for path, value in found.items()}


def _lists(state: State, name: str) -> dict[str, Any]:
    """Lists of sections that an effect of the base has: a scenario's list replaces that of its base."""
    effect = state.effects.get(name)
    return {
        field: [item.model_dump(mode="json", exclude_unset=True) for item in value]
        for field, value in (effect or ())
        if isinstance(value, tuple) and value and isinstance(value[0], BaseModel)
    }


def fitted_numbers(added: Added, covariance: Array, deviations: Array) -> dict[str, ParameterEstimate]:
    """An effect's fitted fields with 95 % intervals, within what each field can be.

    Args:
        added: the fitted effect.
        covariance: of its coefficients.
        deviations: standard deviations of what the fit moved of its shapes.
    """
    found = added.fitting.report(added.coefficients, covariance, added.shapes, deviations, added.orders)
    return {
        path: ParameterEstimate(value=one.value, interval=_possible(one, *added.limits(path)))
        for path, one in found.items()
    }


def _possible(one: Ranged, least: float, most: float) -> tuple[float, float] | None:
    """An interval, without what the field cannot be."""
    return None if math.isnan(one.low) else (max(one.low, least), min(one.high, most))


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def _all_rounded(value: Any) -> Any:
    if isinstance(value, float):
        return _rounded(value)
    if isinstance(value, dict):
        return {key: _all_rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_all_rounded(item) for item in value]
    return value
