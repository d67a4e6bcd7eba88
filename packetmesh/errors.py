"""Errors with a message for people: one sentence that names the thing, its value and what to try."""


class PacketMeshError(Exception):
    """Base of the errors that the app and the command line show as their message, without a stack trace."""


class InputError(PacketMeshError):
    """A file, value or combination of values that cannot be used."""


class ReconstructionError(PacketMeshError):
    """The input was readable, but a stage could not produce a result from it."""
