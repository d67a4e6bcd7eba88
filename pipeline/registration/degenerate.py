"""When pairs do not determine a motion (SPEC 4.1)."""

from packetmesh.errors import ReconstructionError


class DegenerateError(ReconstructionError):
    """The pairs leave the motion undetermined; the message gives the reason in a few words."""
