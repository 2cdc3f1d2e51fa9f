"""Every bench procedure by name: importing this imports the modules that define them."""

from __future__ import annotations

import hdsim.studies.bench  # noqa: F401 - importing registers
from hdsim.studies.registry import Procedure, named, registered_procedures


def procedures() -> dict[str, Procedure]:
    """Every bench procedure by name."""
    return dict(registered_procedures)


def find_procedure(name: str) -> Procedure:
    """The procedure of that name.

    Raises:
        InputError: there is none; the message names the nearest.
    """
    return named("procedure", name, procedures())
