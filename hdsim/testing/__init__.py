"""For those who write effects: ``check_effect`` holds one to everything that hdsim relies on."""

from hdsim.testing.effect import check_effect

__all__ = ["check_effect"]
