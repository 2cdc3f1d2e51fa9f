"""The errors that a user of hdsim can meet; every one carries a message that stands on its own."""

from __future__ import annotations


class HdsimError(Exception):
    """Base of every error that hdsim raises on purpose; the command line prints it and exits with 2."""


class InputError(HdsimError):
    """Something that the user wrote or named is wrong: a scenario, a file, an option."""


class PhysicsError(HdsimError):
    """The parameters describe a drive that cannot exist, or leave a law's range of validity."""


class PluginWarning(UserWarning):
    """Another package adds something to hdsim that cannot be used; the command line prints it in one line."""
