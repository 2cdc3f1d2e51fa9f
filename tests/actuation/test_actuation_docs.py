import re
from pathlib import Path

from pydantic import TypeAdapter
from ruamel.yaml import YAML

from hdsim.actuation.command import Command, PositionCommand
from hdsim.actuation.loads import Load
from hdsim.actuation.signals import AngleTrajectory

PAGE = Path(__file__).parents[2] / "docs" / "actuation.md"


def test_every_example_of_the_docs_is_valid():
    readers = {
        "trajectory": TypeAdapter(AngleTrajectory).validate_python,
        "command": Command.model_validate,
        "load": Load.model_validate,
        "controller": lambda law: PositionCommand.model_validate(
            {"type": "position", "trajectory": {"type": "hold"}, "controller": law}
        ),
    }
    seen = set()
    for example in re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        for section, content in YAML(typ="safe").load(example).items():
            readers[section](content)
            seen.add(section)
    assert seen == set(readers)
