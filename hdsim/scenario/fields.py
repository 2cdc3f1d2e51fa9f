"""What a pydantic annotation allows, so that errors can speak of fields in the user's words."""

from __future__ import annotations

import re
import types
from collections.abc import Mapping, Sequence
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

#: Name parts that make a unit suffix (``stiffness_nm_per_rad``), and how the unit is written.
UNITS = {
    "nm": "N m", "n": "N", "rad": "rad", "rad2": "rad^2", "deg": "deg", "arcmin": "arcmin", "v": "V",
    "rpm": "rpm", "s": "s", "s2": "s^2", "ms": "ms", "us": "us", "hz": "Hz", "kg": "kg", "m": "m",
    "m2": "m^2", "mm": "mm", "um": "um", "pa": "Pa", "mpa": "MPa", "gpa": "GPa", "w": "W", "j": "J", "k": "K",
    "a": "A", "degc": "degC", "arcsec": "arcsec", "s3": "s^3", "ohm": "ohm", "h": "H", "percent": "%",
    "turns": "turns", "rad3": "rad^3", "mrad": "mrad",
}  # fmt: skip


class Shape(NamedTuple):
    """What may stand in one place of a scenario.

    Args:
        choices: the types that are allowed, one entry when there is no choice; null is left out.
        optional: whether null may stand there.
        discriminator: key that chooses among models, if there is one.
        metadata: bounds, as annotated_types writes them.
        description: what the field is, from its docstring.
        name: name of the field, empty inside a list.
    """

    choices: tuple[Any, ...]
    optional: bool = False
    discriminator: str | None = None
    metadata: tuple[Any, ...] = ()
    description: str = ""
    name: str = ""

    @property
    def models(self) -> dict[str, type[BaseModel]]:
        """Models among the choices, by the discriminator's value or, without one, by class name."""
        found: dict[str, type[BaseModel]] = {}
        for choice in self.choices:
            if is_model(choice):
                names = _tags(choice, self.discriminator) if self.discriminator else (choice.__name__,)
                found.update(dict.fromkeys(names, choice))
        return found

    @property
    def is_path(self) -> bool:
        """Whether the path of a file may stand here."""
        return any(isinstance(choice, type) and issubclass(choice, Path) for choice in self.choices)

    def narrowed(self, value: Any) -> Shape:
        """With the model that ``value`` (a mapping) chooses by its discriminator as the only choice."""
        if self.discriminator and isinstance(value, Mapping):
            model = self.models.get(str(value.get(self.discriminator)))
            if model is not None:
                return self._replace(choices=(model,), discriminator=None)
        return self

    def child(self, item: str | int) -> Shape | None:
        """What may stand under ``item``: a field's name, a mapping's key or a list's index."""
        for choice in self.choices:
            if is_model(choice):
                shape = _shapes_of_fields(choice).get(item)
                if shape is not None:
                    return shape
            origin, arguments = get_origin(choice), get_args(choice)
            if isinstance(item, int) and _is_list(choice) and arguments:
                fixed = origin is tuple and arguments[-1] is not Ellipsis
                return shape_of(arguments[min(item, len(arguments) - 1) if fixed else 0])
            if isinstance(item, str) and _is_dict(choice) and len(arguments) == 2:
                return shape_of(arguments[1])
        return None


def is_model(annotation: Any) -> bool:
    """Whether an annotation is a pydantic model."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


@cache
def _shapes_of_fields(model: type[BaseModel]) -> dict[str | int, Shape]:
    """Shapes of a model's fields, by name and by alias."""
    found: dict[str | int, Shape] = {}
    for name, field in model.model_fields.items():
        for key in (name, field.alias):
            if key is not None:
                found.setdefault(key, shape_of_field(name, field))
    return found


def shape_of_field(name: str, field: FieldInfo) -> Shape:
    """Shape of a model's field."""
    shape = shape_of(field.annotation)
    discriminator = field.discriminator if isinstance(field.discriminator, str) else shape.discriminator
    return shape._replace(
        discriminator=discriminator,
        metadata=(*shape.metadata, *field.metadata),
        description=field.description or shape.description,
        name=name,
    )


def shape_of(annotation: Any) -> Shape:
    """Shape of a bare annotation."""
    annotation = getattr(annotation, "__value__", annotation)
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *extras = get_args(annotation)
        shape = shape_of(inner)
        for extra in extras:
            if isinstance(extra, FieldInfo):
                shape = shape._replace(
                    metadata=(*shape.metadata, *extra.metadata),
                    discriminator=extra.discriminator if isinstance(extra.discriminator, str) else None,
                    description=extra.description or shape.description,
                )
            else:
                shape = shape._replace(metadata=(*shape.metadata, extra))
        return shape
    if origin in (Union, types.UnionType):
        shapes = [shape_of(argument) for argument in get_args(annotation) if argument is not type(None)]
        optional = type(None) in get_args(annotation) or any(shape.optional for shape in shapes)
        if len(shapes) == 1:
            return shapes[0]._replace(optional=optional)
        tags = [shape.discriminator for shape in shapes if shape.discriminator]
        return Shape(
            tuple(choice for shape in shapes for choice in shape.choices),
            optional,
            discriminator=tags[0] if tags else None,
            metadata=tuple(extra for shape in shapes for extra in shape.metadata),
        )
    if annotation is type(None):
        return Shape((), optional=True)
    return Shape((annotation,))


def split_unit(name: str) -> tuple[str, str]:
    """A field's name in words, and the unit that it ends with or an empty text.

    Example:
        >>> split_unit("torsional_stiffness_nm_per_rad"), split_unit("gain_per_s"), split_unit("ratio")
        (('torsional stiffness', 'N m/rad'), ('gain', '1/s'), ('ratio', ''))
    """
    parts = name.split("_")
    start = len(parts)
    while start > 1 and (parts[start - 1] in UNITS or parts[start - 1] == "per"):
        start -= 1
    inverse = parts[start : start + 1] == ["per"]
    over, _, under = " ".join(["1", *parts[start:]] if inverse else parts[start:]).partition(" per ")
    unit = "1" if inverse else " ".join(UNITS[part] for part in over.split() if part != "per")
    below = " ".join(UNITS[part] for part in under.split() if part != "per")
    if below:
        unit += f"/({below})" if " " in below else f"/{below}"
    return " ".join(parts[:start]), unit


def words(shape: Shape, *, with_description: bool = True) -> str:
    """What is expected in a place, such as ``a number greater than 0 (Coulomb friction, N m)``."""
    parts: list[str] = []
    for choice in shape.choices:
        phrase = _phrase(choice, shape)
        if phrase not in parts:
            parts.append(phrase)
    if shape.optional:
        parts.append("null")
    text = " or ".join(parts) or "a value"
    limits = _bounds(shape.metadata)
    if limits:
        text += f" {limits}"
    unit = split_unit(shape.name)[1]
    description = " ".join(shape.description.split())
    sentence = description.split(". ")[0].rstrip(".")
    said = with_description and re.search(rf"(?<!\w){re.escape(unit)}(?!\w)", sentence)
    if unit and not said:
        text += f" in {unit}"
    if with_description and sentence:
        text += f" ({sentence if len(sentence) <= 110 else sentence[:107] + '...'})"
    return text


def _phrase(choice: Any, shape: Shape) -> str:
    """One allowed type in words."""
    simple = {float: "a number", int: "a whole number", bool: "true or false", str: "text", Any: "any value"}
    origin, arguments = get_origin(choice), get_args(choice)
    if choice in simple:
        return simple[choice]
    if origin is Literal:
        return "one of " + ", ".join(repr(value) for value in arguments)
    if isinstance(choice, type) and issubclass(choice, Enum):
        return "one of " + ", ".join(repr(member.value) for member in choice)
    if isinstance(choice, type) and issubclass(choice, Path):
        return "the path of a file"
    if is_model(choice):
        if shape.discriminator:
            return f"a mapping whose {shape.discriminator} is one of {', '.join(map(repr, shape.models))}"
        return f"a mapping with {listed(choice.model_fields)}"
    if _is_list(choice):
        if origin is tuple and arguments and arguments[-1] is not Ellipsis:
            return f"a list of {len(arguments)} ({', '.join(_noun(each) for each in arguments)})"
        return f"a list of {_noun(arguments[0])} items" if arguments else "a list"
    if _is_dict(choice):
        return "a mapping"
    return f"a {getattr(choice, '__name__', choice)}"


def _noun(annotation: Any) -> str:
    text = words(shape_of(annotation), with_description=False)
    return text.removeprefix("a ").removeprefix("an ")


def _bounds(metadata: Sequence[Any]) -> str:
    """Bounds in words, from objects that carry ``gt``, ``ge``, ``lt``, ``le``, lengths or a step."""
    names = {
        "gt": "greater than {:.12g}",
        "ge": "at least {:.12g}",
        "lt": "less than {:.12g}",
        "le": "at most {:.12g}",
        "multiple_of": "in steps of {:.12g}",
        "min_length": "of length at least {}",
        "max_length": "of length at most {}",
        "pattern": "that matches {!r}",
    }
    found = {
        text.format(value): None
        for extra in metadata
        for name, text in names.items()
        if (value := getattr(extra, name, None)) is not None
    }
    return " and ".join(found)


def listed(names: Any, limit: int = 12) -> str:
    """Names, separated by commas, at most ``limit`` of them."""
    all_names = [str(name) for name in names]
    more = f" and {len(all_names) - limit} more" if len(all_names) > limit else ""
    return ", ".join(all_names[:limit]) + more


def _tags(model: type[BaseModel], discriminator: str | None) -> tuple[str, ...]:
    field = model.model_fields.get(discriminator or "")
    if field is None:
        return ()
    return tuple(str(getattr(value, "value", value)) for value in get_args(field.annotation))


def _is_list(annotation: Any) -> bool:
    origin = get_origin(annotation) or annotation
    listlike = (list, tuple, set, frozenset, Sequence)
    return isinstance(origin, type) and issubclass(origin, listlike) and not issubclass(origin, str | bytes)


def _is_dict(annotation: Any) -> bool:
    origin = get_origin(annotation) or annotation
    return isinstance(origin, type) and issubclass(origin, dict | Mapping)
