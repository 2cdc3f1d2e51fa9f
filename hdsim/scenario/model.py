"""The scenario: everything that a user says about one simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from pydantic import BaseModel, Field, create_model, model_validator

from hdsim.actuation.command import Command
from hdsim.actuation.loads import Load
from hdsim.drive.parameters import Drive
from hdsim.effects import catalogue
from hdsim.parts import Effect, Parameters
from hdsim.scenario.extends import read
from hdsim.scenario.settings import LiveOptions, LogOptions, Run
from hdsim.scenario.validation import build
from hdsim.scenario.writer import to_yaml


class EffectChoice(Parameters):
    """Physical effects by name; one that is not named is off."""

    def active(self) -> dict[str, Effect]:
        """The effects that are on, by name."""
        return {
            name: effect for name in type(self).model_fields if (effect := getattr(self, name)) is not None
        }


def _effects() -> type[EffectChoice]:
    """The class of the section ``effects``: one optional field for every effect that there is."""
    fields: dict[str, Any] = {
        name: (effect | None, Field(None, description=(effect.__doc__ or effect.title).split("\n")[0]))
        for name, effect in catalogue().items()
    }
    return cast(type[EffectChoice], create_model("Effects", __base__=EffectChoice, **fields))


if TYPE_CHECKING:
    Effects = EffectChoice
else:
    Effects = _effects()
    Effects.__doc__ = EffectChoice.__doc__


class Scenario(Parameters):
    """A drive, what acts on it, and how it is simulated and logged."""

    name: str = Field("", max_length=200)
    """Name of the scenario; the file's name when left out."""
    description: str = Field("", max_length=10_000)
    """What the scenario shows."""
    drive: Drive
    """The harmonic drive."""
    effects: Effects = Effects()
    """Physical effects that are on."""
    command: Command
    """What drives the motor and moves the output."""
    load: Load
    """What hangs on the output."""
    run: Run
    """How the model is integrated and sampled."""
    log: LogOptions = LogOptions()
    """What the log contains."""
    live: LiveOptions = LiveOptions()
    """What may be changed while it runs, for ``hdsim run --live``."""

    @model_validator(mode="after")
    def _live_numbers(self) -> Scenario:
        for name in self.live.parameters:
            found: Any = self
            for part in name.split("."):
                found = getattr(found, part, None)
            if isinstance(found, bool) or not isinstance(found, int | float):
                raise ValueError(f"live.parameters: {name} is no number that this scenario states")
        return self

    @classmethod
    def from_yaml(cls, path: str | Path) -> Scenario:
        """Read a scenario, and what it extends.

        Raises:
            hdsim.scenario.ScenarioError: with one line for every mistake: file, line, field, what was found,
                what is allowed.
        """
        source = read(path)
        named_in = source.marks.get(("name",))
        if named_in is None or named_in.file != str(path):
            # A name taken over from an extended file would give two scenarios one name.
            source.data["name"] = Path(path).stem[:200]
        return build(source, cls)

    def to_yaml(self) -> str:
        """The whole scenario as YAML: defaults, presets and extended files resolved, paths absolute."""
        data = self.model_dump(mode="json")
        for section in ("effects", "command", "load", "run", "log", "live"):
            data[section] = _without_unset(getattr(self, section), data[section])
        return to_yaml(data)

    def summary(self) -> str:
        """A few lines on what the scenario describes."""
        drive, load, run = self.drive, self.load, self.run
        about = self.description.strip().split("\n")[0]
        load_parts = [f"{load.inertia_kg_m2:g} kg m^2"] if load.inertia_kg_m2 > 0 else []
        if load.torque is not None:
            load_parts.append("torque over time")
        if load.gravity is not None:
            load_parts.append("gravity arm")
        if load.arm is not None:
            load_parts.append(f"{load.arm.joint} of {load.arm.file.name}")
        samples = round(run.duration_s * run.sample_rate_hz)
        lines = {
            "scenario": f"{self.name}: {about}" if about else self.name,
            "drive": f"{drive.preset or 'own numbers'}, ratio {drive.ratio:g}, "
            f"rated torque {drive.rated_torque_nm:g} N m, {drive.mesh.model} mesh",
            "effects": ", ".join(self.effects.active()) or "none",
            "command": f"motor {self.command.motor.type}, output {self.command.output.type}",
            "load": ", ".join(load_parts),
            "run": f"{run.duration_s:g} s, method {run.method}, rtol {run.rtol:g}, {samples} samples, "
            f"seed {run.seed}",
        }
        return "\n".join(f"  {title:<9} {line}" for title, line in lines.items())


def _without_unset(model: BaseModel, data: dict[str, Any]) -> dict[str, Any]:
    """Dumped ``data`` of ``model`` without the nulls that are the default anyway."""
    kept: dict[str, Any] = {}
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if value is None and field.default is None:
            continue
        if isinstance(value, BaseModel):
            kept[name] = _without_unset(value, data[name])
        elif isinstance(value, list | tuple):
            kept[name] = [
                _without_unset(item, dumped) if isinstance(item, BaseModel) else dumped
                for item, dumped in zip(value, data[name], strict=True)
            ]
        else:
            kept[name] = data[name]
    return kept
