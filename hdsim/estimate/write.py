"""Step 6, add: a scenario that extends the base with what was found, and runs like any other."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from hdsim.effects._fitting import Amplitude, Harmonic, Inverse
from hdsim.estimate.found import FittedNumber
from hdsim.estimate.freedom import Added, Free, State, merge, number_at, put
from hdsim.estimate.records import Array


def scenario_text(base: Path, state: State, freedoms: Sequence[Free], start: State, beside: Path) -> str:
    """YAML of the scenario.

    Args:
        base: file of the base scenario.
        state: the fitted model.
        freedoms: the base's numbers as they were.
        start: the base model.
        beside: the directory in which the scenario will stand.
    """
    from hdsim.scenario.writer import to_yaml

    data: dict[str, Any] = {
        "name": f"{base.stem} with what was found"[:200],
        "description": "Written by a diagnosis: the base, its numbers fitted to measured data, and effects.",
        "extends": os.path.relpath(base, beside),
    }
    for free in freedoms:
        for path in free.paths:
            if path == "gain" or free.step:
                continue  # the log's, not the model's; the gain is written as a sensor's below
            new, old = number_at(state, path), number_at(start, path)
            if new is not None and old is not None and new != old:
                put(data, path, _rounded(new))
    effects: dict[str, Any] = {}
    for added in state.added:
        known = effects.setdefault(added.effect, _lists(start, added.effect))
        merge(known, _all_rounded(added.settings()))
    if abs(state.gain - 1.0) > 1e-9:
        put(effects, "sensors.motor_torque.gain_error", _rounded(state.gain - 1.0))
    if effects:
        merge(data.setdefault("effects", {}), effects)
    return to_yaml(data)


def _lists(state: State, name: str) -> dict[str, Any]:
    """Lists of sections that an effect of the base has: a scenario's list replaces that of its base."""
    effect = state.effects.get(name)
    return {
        field: [item.model_dump(mode="json", exclude_unset=True) for item in value]
        for field, value in (effect or ())
        if isinstance(value, tuple) and value and isinstance(value[0], BaseModel)
    }


def fitted_numbers(added: Added, covariance: Array, shape_spreads: Array) -> dict[str, FittedNumber]:
    """An effect's fitted fields with 95 % intervals.

    Args:
        added: the fitted effect.
        covariance: of its coefficients.
        shape_spreads: standard deviations of the logarithms of its shapes.
    """
    found: dict[str, FittedNumber] = {}
    at = 0
    c = added.coefficients
    spread = 2.0 * np.sqrt(np.maximum(np.diag(covariance), 0.0))

    def harmonic(amplitude: str, phase: str, unit: float) -> None:
        nonlocal at
        a, b = c[at], c[at + 1]
        size = math.hypot(a, b)
        part = covariance[at : at + 2, at : at + 2]
        along = np.array([a, b]) / max(size, 1e-12)
        half = 2.0 * math.sqrt(max(float(along @ part @ along), 0.0))
        found[amplitude] = _value(unit * size, unit * max(size - half, 0.0), unit * (size + half))
        angle = math.degrees(math.atan2(b, a))
        wide = _seen_under(np.array([a, b]), part)
        found[phase] = _value(angle, angle - wide, angle + wide)
        at += 2

    for term in added.fitting.terms:
        if isinstance(term, Amplitude):
            for path, unit in term.units.items():
                low = c[at] - spread[at] if term.signed else max(c[at] - spread[at], 0.0)
                below = found.get(path)
                if below is None:
                    found[path] = _value(unit * c[at], unit * low, unit * (c[at] + spread[at]))
                else:
                    value, half = below.value + unit * c[at], unit * spread[at]
                    found[path] = _value(value, value - half, value + half)
            at += 1
        elif isinstance(term, Inverse):
            low, high = max(c[at] - spread[at], 1e-9), c[at] + spread[at]
            found[term.path] = _value(term.unit / max(c[at], 1e-9), term.unit / high, term.unit / low)
            at += 1
        elif isinstance(term, Harmonic):
            harmonic(term.amplitude, term.phase, term.unit)
        else:
            before = len(added.fitting.items(term.section))
            for k, order in enumerate(added.orders, start=before):
                path = f"{term.section}.{k}"
                found[f"{path}.order"] = FittedNumber(value=order)
                harmonic(f"{path}.{term.amplitude}", f"{path}.phase_deg", term.unit)
    for shape, value, deviation in zip(added.fitting.shapes, added.shapes, shape_spreads, strict=True):
        factor = math.exp(min(2.0 * float(deviation), 20.0))
        found[shape.path] = _value(value, value / factor, value * factor)
    return found


def _seen_under(centre: Array, covariance: Array) -> float:
    """Largest angle from a vector to its 95 % ellipse, degrees; 180 where that holds the origin."""
    values, vectors = np.linalg.eigh(covariance)
    axes = 2.0 * np.sqrt(np.maximum(values, 0.0))
    if np.sum((vectors.T @ centre / np.maximum(axes, 1e-300)) ** 2) <= 1.0:
        return 180.0
    turn = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    edge = centre[:, None] + vectors @ (axes[:, None] * np.array([np.cos(turn), np.sin(turn)]))
    away = np.arctan2(centre[0] * edge[1] - centre[1] * edge[0], centre @ edge)
    return float(np.degrees(np.max(np.abs(away))))


def _value(value: float, low: float, high: float) -> FittedNumber:
    return FittedNumber(value=value, interval=(low, high))


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
