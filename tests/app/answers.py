"""Jobs run to their end."""

from packetmesh.progress import drain


def end(job):
    """What a job answers."""
    return drain(job)
