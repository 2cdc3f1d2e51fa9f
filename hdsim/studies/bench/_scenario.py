"""What the bench tests have in common: how their scenarios are put together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hdsim.scenario import Scenario


def bench(
    drive: Mapping[str, Any],
    motor: Mapping[str, Any],
    load: Mapping[str, Any],
    run: Mapping[str, Any],
    *,
    name: str,
    effects: Mapping[str, Any] | None = None,
    output: Mapping[str, Any] | None = None,
    over: Mapping[str, Any] | None = None,
) -> Scenario:
    """A scenario of a bench test.

    Args:
        drive: section ``drive``.
        motor: what drives the motor, ``command.motor``.
        load: section ``load``.
        run: section ``run``; no tooth forces unless it asks for them.
        name: name of the scenario.
        effects: section ``effects``.
        output: what moves the output, ``command.output``.
        over: fields of ``run`` that win over the test's own.
    """
    command: dict[str, Any] = {"motor": dict(motor)}
    if output is not None:
        command["output"] = dict(output)
    return Scenario.model_validate(
        {
            "name": name,
            "drive": dict(drive),
            "effects": dict(effects or {}),
            "command": command,
            "load": dict(load),
            "run": {"teeth_rate_hz": 0} | dict(run) | dict(over or {}),
        }
    )


def with_bearing(
    effects: Mapping[str, Any] | None, coulomb_nm: float, viscous_nm_s_per_rad: float = 0.0
) -> dict[str, Any]:
    """The effects, with friction of the bench's output bearing unless they have load-side friction.

    A drive without any load rattles in its gap; on a real bench bearing and seal hold the flanks together.
    """
    found = dict(effects or {})
    if coulomb_nm + viscous_nm_s_per_rad > 0.0 and found.get("load_side_friction") is None:
        found["load_side_friction"] = {
            "coulomb_nm": coulomb_nm,
            "viscous_nm_s_per_rad": viscous_nm_s_per_rad,
        }
    return found
