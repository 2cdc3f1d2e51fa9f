"""JSON schema of what a user writes, so that editors complete, explain and check it."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

from pydantic import BaseModel

from hdsim.scenario.fields import split_unit

DIALECT = "https://json-schema.org/draft/2020-12/schema"

Schema = dict[str, Any]


def json_schema(model: type[BaseModel]) -> Schema:
    """JSON schema (draft 2020-12) of the files that ``load_model`` reads into ``model``.

    A file with ``extends`` may leave out anything and remove anything with ``null``, so the schema has two
    sides: the model itself, and a copy of it without required keys for files that extend another.

    Args:
        model: the class.

    Returns:
        The schema as plain data; fields with a unit in their name carry it as ``unit`` and in the title.
    """
    whole = model.model_json_schema(ref_template="#/$defs/{model}")
    definitions: Schema = whole.pop("$defs", {})
    name = str(whole.get("title", model.__name__))
    definitions[name] = whole
    for definition in definitions.values():
        _tell_units(definition)
    partial = {f"{key}.partial": _loosened(definition) for key, definition in definitions.items()}
    for key in [
        key for key, definition in definitions.items() if "preset" in definition.get("properties", {})
    ]:
        # A preset gives what is left out, as an extended file does.
        partial[f"{key}.whole"] = definitions[key]
        definitions[key] = {
            "if": {"required": ["preset"], "properties": {"preset": {"type": "string"}}},
            "then": {"$ref": f"#/$defs/{key}.partial"},
            "else": {"$ref": f"#/$defs/{key}.whole"},
        }
    extends = {
        "type": "string",
        "title": "Extends",
        "description": "Path, relative to this file, of a scenario that gives what this one leaves out.",
    }
    partial[f"{name}.partial"]["properties"]["extends"] = extends
    return {
        "$schema": DIALECT,
        "title": f"hdsim {name.lower()}",
        "if": {"required": ["extends"]},
        "then": {"$ref": f"#/$defs/{name}.partial"},
        "else": {"$ref": f"#/$defs/{name}"},
        "$defs": definitions | partial,
    }


def _tell_units(definition: Schema) -> None:
    """Put the unit of every property beside it and into its title; say what a section without words holds."""
    for name, entry in definition.get("properties", {}).items():
        choice = entry.get("discriminator")
        if choice and "description" not in entry:
            entry["description"] = f"Its {choice['propertyName']} is one of {', '.join(choice['mapping'])}."
        words, unit = split_unit(name)
        if unit and "$ref" not in entry:
            entry["unit"] = unit
            entry["title"] = f"{words.capitalize()} ({unit})"


def _loosened(value: Any) -> Any:
    """A copy in which no key is required and every property may be null, for files that extend another."""
    if isinstance(value, list):
        return [_loosened(item) for item in value]
    if not isinstance(value, dict):
        return deepcopy(value)
    result: Schema = {}
    for key, item in value.items():
        if key == "required" and isinstance(item, list):
            continue
        if key in ("default", "const", "enum", "examples"):
            result[key] = deepcopy(item)
        elif key == "$ref":
            result[key] = f"{item}.partial"
        elif key == "discriminator":
            continue
        elif key == "oneOf":
            # Without required discriminators several members can match.
            result["anyOf"] = _loosened(item)
        elif key == "properties":
            result[key] = {
                name: {"anyOf": [_loosened(entry), {"type": "null"}]} for name, entry in item.items()
            }
        else:
            result[key] = _loosened(item)
    return result
