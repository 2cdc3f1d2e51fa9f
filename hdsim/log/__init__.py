"""MCAP logs: written while a run goes on, read back bit by bit, verified, recovered and exported.

Names are resolved on first use, so that importing this package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdsim.log.check import VerifyReport as VerifyReport
    from hdsim.log.check import verify_log as verify_log
    from hdsim.log.export import export_log as export_log
    from hdsim.log.info import LogInfo as LogInfo
    from hdsim.log.info import info_log as info_log
    from hdsim.log.reader import open_log as open_log
    from hdsim.log.reader import read_attachments as read_attachments
    from hdsim.log.recovery import RecoverReport as RecoverReport
    from hdsim.log.recovery import recover_log as recover_log
    from hdsim.log.whole import write_log as write_log
    from hdsim.log.writer import LogWriter as LogWriter

_HOME = {
    "LogInfo": "info",
    "LogWriter": "writer",
    "RecoverReport": "recovery",
    "VerifyReport": "check",
    "export_log": "export",
    "info_log": "info",
    "open_log": "reader",
    "read_attachments": "reader",
    "recover_log": "recovery",
    "verify_log": "check",
    "write_log": "whole",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    try:
        module = _HOME[name]
    except KeyError:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None
    return getattr(import_module(f"{__name__}.{module}"), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
