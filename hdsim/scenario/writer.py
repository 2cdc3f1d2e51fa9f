"""Plain data as YAML that this package reads back to the same values."""

from __future__ import annotations

import io
import re
from typing import Any

from hdsim.scenario.reader import resolve

_AWKWARD = re.compile(r"[^\x20-\x7e\n\u00a0-\ud7ff]")


def to_yaml(data: dict[str, Any]) -> str:
    """Write mappings, lists, text, numbers, true/false and null as block-style YAML, keys in their order."""
    from ruamel.yaml import YAML
    from ruamel.yaml.representer import SafeRepresenter

    class Representer(SafeRepresenter):
        """Quotes exactly the text that would be read as something else."""

    def text(representer: Any, value: str) -> Any:
        style = '"' if _AWKWARD.search(value) or not isinstance(resolve(value), str) else None
        return representer.represent_scalar("tag:yaml.org,2002:str", value, style=style)

    def number(representer: Any, value: float) -> Any:
        return representer.represent_scalar("tag:yaml.org,2002:float", repr(value))

    Representer.add_representer(str, text)
    Representer.add_representer(float, number)
    yaml = YAML(typ="safe", pure=True)
    yaml.Representer = Representer
    yaml.default_flow_style = False
    yaml.allow_unicode = True
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 110
    stream = io.StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()
