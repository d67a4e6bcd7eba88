"""Errors a person can act on: one sentence that names the thing, its value and what to try."""


class PacketMeshError(Exception):
    """Base of every error that is shown to people as a single sentence, never as a stack trace."""


class InputError(PacketMeshError):
    """A file, value or combination of values that cannot be used."""


class ReconstructionError(PacketMeshError):
    """The input was readable, but a stage could not produce a result from it."""
