"""What a recording says about itself: its title, its drive, the footer."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.recording import Recording


@lru_cache(maxsize=8)
def _parsed(text: str) -> dict[str, Any] | None:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        found = YAML(typ="safe", pure=True).load(text)
    except YAMLError:
        return None
    return found if isinstance(found, dict) else None


def scenario_of(recording: Recording) -> dict[str, Any] | None:
    """The scenario in the metadata as plain data; None when there is none or it is not YAML."""
    return _parsed(recording.metadata.get("scenario", ""))


def drive_of(recording: Recording) -> dict[str, Any] | None:
    """The scenario's drive section; None when there is none."""
    scenario = scenario_of(recording) or {}
    drive = scenario.get("drive")
    return drive if isinstance(drive, dict) else None


def title(recording: Recording) -> str:
    """Name of the run."""
    return recording.metadata.get("scenario_name") or "recording"


def subtitle(recording: Recording) -> str:
    """The scenario's description, and the drive with its load and effects."""
    scenario, drive = scenario_of(recording) or {}, drive_of(recording) or {}
    parts = []
    if drive:
        parts.append(f"drive {drive.get('preset') or 'without preset'}")
        mesh = drive.get("mesh")
        if isinstance(mesh, dict) and "model" in mesh:
            parts.append(f"{mesh['model']} mesh")
    load = scenario.get("load")
    if isinstance(load, dict) and load.get("inertia_kg_m2"):
        parts.append(f"load {load['inertia_kg_m2']:g} kg m²")
    effects = scenario.get("effects")
    if isinstance(effects, dict) and effects:
        parts.append("effects: " + ", ".join(name.replace("_", " ") for name in effects))
    described = " ".join(str(scenario.get("description") or "").split())
    return "\n".join(line for line in (described, "   ·   ".join(parts)) if line)


def footer(recording: Recording) -> str:
    """Where the numbers come from: versions, solver, seed, energy audit."""
    data = recording.metadata
    parts = []
    if "version_hdsim" in data:
        parts.append(f"hdsim {data['version_hdsim']}")
    if "git" in data:
        parts.append(f"commit {data['git']}")
    if "method" in data:
        solver = f"solver {data['method']}"
        if "rtol" in data:
            solver += f", rtol {data['rtol']}"
        if "steps" in data:
            solver += f", {data['steps']} steps"
        parts.append(solver)
    if "seed" in data:
        parts.append(f"seed {data['seed']}")
    if "energy_residual_j" in data:
        residual = f"energy residual {data['energy_residual_j']} J"
        if "energy_exchanged_j" in data:
            residual += f" of {data['energy_exchanged_j']} J"
        parts.append(residual)
    return "   ·   ".join(parts)


def trouble(recording: Recording) -> str:
    """Why the run is not whole; empty when it is."""
    errors = [event for event in recording.events if event.level == "error"]
    if errors:
        first = errors[0]
        return f"stopped at {first.time:.6g} s: {first.message}"
    return recording.metadata.get("failure", "")
