"""The scenario: everything that a user says about one simulation."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from pydantic import (
    BaseModel,
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    create_model,
    field_validator,
    model_serializer,
    model_validator,
)

from hdsim.actuation.command import Command
from hdsim.actuation.loads import Load
from hdsim.drive.parameters import Drive
from hdsim.drive.presets import catalogue_figures, preset_names
from hdsim.effects import catalogue
from hdsim.effects._sizes import sized_defaults
from hdsim.errors import InputError
from hdsim.nested import copied
from hdsim.parts import DriveSize, Effect, Parameters
from hdsim.scenario.extends import read
from hdsim.scenario.names import check, choices_first, set_value
from hdsim.scenario.problems import Mark, Problem, ScenarioError
from hdsim.scenario.reader import Source, flatten, parse
from hdsim.scenario.settings import Evaluation, LiveOptions, LogOptions, Run
from hdsim.scenario.validation import build
from hdsim.scenario.writer import to_yaml


class EffectChoice(Parameters):
    """Physical effects by name; one that is not named is off."""

    set: Literal["catalogue"] | None = None
    """``catalogue``: kinematic error and torsional hysteresis as large as the preset's catalogue says; an
    effect that is named beside it has its own numbers, and null turns it off."""

    @model_serializer(mode="wrap")
    def _on_alone(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Effects that are on: null is written where it turns one of a set off, and the set is resolved."""
        return {name: data for name, data in dump(self).items() if data is not None}

    def active(self) -> dict[str, Effect]:
        """The effects that are on, by name."""
        found = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: effect for name, effect in found.items() if isinstance(effect, Effect)}


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


def size_of(drive: Drive) -> DriveSize:
    """What the default numbers of effects depend on."""
    figures = catalogue_figures(drive.preset) if drive.preset in preset_names() else None
    return DriveSize(
        drive.rated_torque_nm,
        abs(drive.ratio),
        drive.torsion.stiffness_k1_nm_per_rad,
        figures.accuracy.value if figures else 0.0,
        figures.hysteresis_loss.value if figures else 0.0,
    )


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
    evaluation: Evaluation = Evaluation()
    """What the run's numbers are held against."""
    log: LogOptions = LogOptions()
    """What the log contains."""
    live: LiveOptions = LiveOptions()
    """What may be changed while it runs, for ``hdsim run --live``."""

    @field_validator("effects", mode="before")
    @classmethod
    def _fit_to_drive(cls, given: Any, info: ValidationInfo) -> Any:
        """Fill what the effects leave open with what fits the drive, so that the scenario states it."""
        drive = info.data.get("drive")
        if drive is None or not isinstance(given, dict):
            return given
        chosen = dict(given)
        if chosen.get("set") == "catalogue":
            if drive.preset not in preset_names():
                raise ValueError(
                    "set: catalogue needs a drive with a preset, whose catalogue it follows; name the "
                    "effects with their numbers instead"
                )
            del chosen["set"]
            chosen = {name: {} for name, effect in catalogue().items() if effect.printed} | chosen
        size = size_of(drive)
        for name, effect in catalogue().items():
            stated = chosen.get(name)
            if isinstance(stated, dict):
                chosen[name] = stated | sized_defaults(effect, stated, size)
        return chosen

    @field_validator("effects")
    @classmethod
    def _held_by_the_drive(cls, effects: Effects, info: ValidationInfo) -> Effects:
        drive: Drive | None = info.data.get("drive")
        if drive is not None:
            for name, effect in effects.active().items():
                if complaint := effect.misfit(drive.least_stiffness_nm_per_rad):
                    raise ValueError(f"{name}.{complaint}")
        return effects

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

    @classmethod
    def from_text(cls, text: str, name: str = "scenario.yaml") -> Scenario:
        """The scenario that ``to_yaml`` wrote, as every log keeps it.

        Args:
            text: YAML that extends nothing.
            name: where errors say that it stands.

        Raises:
            hdsim.scenario.ScenarioError: with one line for every mistake.
        """
        return build(flatten(parse(text, name)), cls)

    def to_yaml(self) -> str:
        """The whole scenario as YAML: defaults, presets and extended files resolved, paths absolute."""
        data = self.model_dump(mode="json")
        for section in ("effects", "command", "load", "run", "evaluation", "log", "live"):
            data[section] = _without_unset(getattr(self, section), data[section])
        return to_yaml(data)

    def with_(self, changes: Mapping[str, Any] | None = None, /, **sections: Any) -> Scenario:
        """A checked copy with other values; relative paths of files count from the working directory.

        >>> scenario.with_({"load.inertia_kg_m2": 0.3, "effects.output_backlash": {}}, name="with play")

        Args:
            changes: values by dotted name, as in a study; a mapping replaces a whole section, ``{}`` turns an
                effect on with its default numbers, None turns it off. Another type, law, model or kind drops
                the numbers of the one before.
            sections: the same for names without a dot.

        Raises:
            hdsim.scenario.ScenarioError: with one line for every name that there is not, with the nearest
                that there is, and for every value that is not allowed.
        """
        data = self.model_dump(mode="json")
        given = {**(changes or {}), **sections}
        source = Mark("scenario")
        problems = []
        for name in choices_first(given):
            try:
                check(name, data, Scenario, lists=True)
                if name == "drive.preset":
                    raise InputError(
                        "the scenario has the old preset's numbers; replace the section: "
                        f"'drive': {{'preset': {given[name]!r}}}"
                    )
                set_value(data, name, copied(given[name]))
            except InputError as error:
                problems.append(Problem(source, name, str(error)))
        if problems:
            raise ScenarioError(problems)
        return build(Source(data, {(): source}), Scenario)

    def _repr_html_(self) -> str:
        from hdsim.notebook import scenario_html

        return scenario_html(self)

    def summary(self) -> str:
        """A few lines on what the scenario describes."""
        lines = {title: line.replace("\n", f"\n{'':12}") for title, line in self.about().items()}
        return "\n".join(f"  {title:<9} {line}" for title, line in lines.items())

    def about(self) -> dict[str, str]:
        """What the scenario describes, by its sections; several lines where one is too long."""
        drive, load, run = self.drive, self.load, self.run
        torsion = drive.torsion
        stiffness = (
            torsion.stiffness_k1_nm_per_rad,
            torsion.stiffness_k2_nm_per_rad,
            torsion.stiffness_k3_nm_per_rad,
        )
        about = self.description.strip().split("\n")[0]
        load_parts = [f"{load.inertia_kg_m2:g} kg m^2"] if load.inertia_kg_m2 > 0 else []
        if load.torque is not None:
            load_parts.append("torque over time")
        if load.gravity is not None:
            load_parts.append("gravity arm")
        if load.arm is not None:
            load_parts.append(f"{load.arm.joint} of {load.arm.file.name}")
        samples = round(run.duration_s * run.sample_rate_hz)
        return {
            "scenario": f"{self.name}: {about}" if about else self.name,
            "drive": f"{drive.preset or 'without preset'}, ratio {drive.ratio:g}, "
            f"rated torque {drive.rated_torque_nm:g} N m, {drive.mesh.model} mesh\n"
            f"K1, K2, K3 {', '.join(f'{k:.0f}' for k in stiffness)} N m/rad; motor and wave generator "
            f"{drive.inertia.rotor_kg_m2:.3g} kg m^2",
            "effects": "\n".join(self._effects_told()) or "none",
            "command": f"motor {self.command.motor.type}, output {self.command.output.type}",
            "load": ", ".join(load_parts),
            "run": f"{run.duration_s:g} s, method {run.method}, rtol {run.rtol:g}, {samples} samples, "
            f"seed {run.seed}",
        }

    def _effects_told(self) -> list[str]:
        """The effects that are on with the numbers in use, those that fit the drive by default among them."""
        lines: list[str] = []
        for name, effect in self.effects.active().items():
            text = f"{name}: {_short(effect)}" if _short(effect) else name
            lines += textwrap.wrap(text, 88, subsequent_indent="  ")
        return lines


def _short(value: Any) -> str:
    """Numbers of a section in one line, without what is not set or nothing; long lists are cut."""
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        told = (
            (name, _short(one))
            for name, one in value
            if one is not None and not (one == 0 and fields[name].default == 0)
        )
        return ", ".join(f"{name} {one}".strip() for name, one in told if one)
    if isinstance(value, list | tuple):
        items = [_short(one) for one in value[:6]] + (["..."] if len(value) > 6 else [])
        return "[" + "; ".join(items) + "]" if items else ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


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
