"""Every field of a scenario, from the models that read it: type, bounds, default and meaning."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PAGE = "reference/scenario-fields"
#: They have a page of their own, with equations, sources and usual ranges.
ELSEWHERE = {"effects": "[effects](../effects.md)"}
BOUNDS = {
    "exclusiveMinimum": "above {:g}",
    "minimum": "at least {:g}",
    "exclusiveMaximum": "below {:g}",
    "maximum": "at most {:g}",
    "minItems": "at least {:g} of them",
    "maxItems": "at most {:g} of them",
}

Schema = dict[str, Any]


def link(name: str) -> str:
    """Reference to a section of the page."""
    return f"[{name}](#{name.lower()})"


def allowed(entry: Schema) -> str:
    """What may stand in a field, in Markdown."""
    if "$ref" in entry:
        return link(entry["$ref"])
    if "const" in entry:
        return f"`{entry['const']}`"
    if "enum" in entry:
        return ", ".join(f"`{json.dumps(value).strip(chr(34))}`" for value in entry["enum"])
    if "discriminator" in entry:
        choice = entry["discriminator"]
        ways = (f"[{value}](#{model.lower()})" for value, model in choice["mapping"].items())
        return f"by `{choice['propertyName']}`: {', '.join(ways)}"
    if several := entry.get("anyOf") or entry.get("oneOf"):
        return " or ".join(dict.fromkeys(allowed(one) for one in several))
    bounds = [words.format(entry[key]) for key, words in BOUNDS.items() if key in entry]
    match entry.get("type"):
        case "array" if "items" in entry:
            kind = f"list of {allowed(entry['items'])}"
        case "array":
            kind = f"list: {', '.join(allowed(one) for one in entry.get('prefixItems', ()))}"
        case "object" if isinstance(entry.get("additionalProperties"), dict):
            kind = f"mapping of names to {allowed(entry['additionalProperties'])}"
        case kind:
            kind = str(kind or "anything")
    return ", ".join([kind, *bounds])


def default(name: str, model: Schema) -> str:
    """What stands in a field that is left out."""
    entry = model["properties"][name]
    if name in model.get("required", ()):
        return "required"
    if "default" not in entry or (isinstance(entry["default"], dict | list) and entry["default"]):
        return "its own defaults"
    text = json.dumps(entry["default"]).strip('"')
    return f"`{text}`" if text else "none"


def plain(text: str) -> str:
    """Text in one line that a cell of a table can hold."""
    return re.sub(r"\s+", " ", text).replace("|", r"\|").replace("<", "&lt;").strip()


def table(model: Schema) -> Iterator[str]:
    """Lines of the table of a model."""
    yield from ("| field | allowed | default | meaning |", "|---|---|---|---|")
    for name, entry in model.get("properties", {}).items():
        meaning = plain(entry.get("description", ""))
        yield f"| `{name}` | {allowed(entry)} | {default(name, model)} | {meaning} |"


def mentioned(entry: Any) -> Iterator[str]:
    """Names of the models that a part of the schema refers to, in order."""
    if isinstance(entry, dict):
        if "$ref" in entry:
            yield entry["$ref"]
        for key, value in entry.items():
            if key not in ("default", "discriminator"):
                yield from mentioned(value)
    elif isinstance(entry, list):
        for value in entry:
            yield from mentioned(value)


def page() -> str:
    """All sections as Markdown."""
    from hdsim.scenario import Scenario

    whole = Scenario.model_json_schema(ref_template="{model}")
    models = whole["$defs"]
    lines = [*table(whole), ""]
    shown: set[str] = set()
    for section, entry in whole["properties"].items():
        waiting = list(mentioned(entry))
        if not waiting:
            continue
        lines += [f"## {section}", "", plain(entry.get("description", "")), ""]
        if section in ELSEWHERE:
            lines += [f"One section for each effect: {ELSEWHERE[section]}.", ""]
            continue
        while waiting:
            name = waiting.pop(0)
            if name in shown:
                continue
            shown.add(name)
            waiting += mentioned(models[name])
            lines += [f"### {name}", "", models[name].get("description", "").replace("<", "&lt;"), ""]
            lines += [*table(models[name]), ""]
    return "\n".join(lines)


def read_page(app: Sphinx, name: str, source: list[str]) -> None:
    """Add the fields to their page."""
    if name == PAGE:
        source[0] += "\n" + page()


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("source-read", read_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
