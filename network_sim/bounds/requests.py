"""Bounds on the bytes that nodes send before the sink requests the others, and on the requests."""

from __future__ import annotations

from collections.abc import Sequence

from packetmesh.checks import at_least
from packetmesh.errors import InputError


def check_requests(first: Sequence[int], requests: Sequence[int], sizes: Sequence[int], images: int) -> None:
    """Check the sizes of nodes that wait for a request.

    Args:
        first: (N,) bytes of its image that each node sends first; empty if none waits.
        requests: (N,) bytes of the request to each.
        sizes: (N,) bytes of their images.
        images: number of images of each node.

    Raises:
        InputError: a size is too small or too large, or some are missing.
    """
    at_least("nodes.first_bytes_by_node", min(first, default=1), 1)
    at_least("nodes.request_bytes_by_node", min(requests, default=0), 0)
    if bool(first) != bool(requests):
        raise InputError(
            "nodes.first_bytes_by_node and nodes.request_bytes_by_node belong together: nodes wait for "
            "requests that have a size; try both or neither"
        )
    if first and images != 1:
        raise InputError(
            f"nodes.images is {images}, but nodes that wait for a request (nodes.first_bytes_by_node) have "
            "one image each; try nodes.images=1"
        )
    for node, (first_bytes, size_bytes) in enumerate(zip(first, sizes, strict=True)):
        if first_bytes > size_bytes:
            raise InputError(
                f"nodes.first_bytes_by_node has {first_bytes} for node {node + 1}, whose image has "
                f"{size_bytes} bytes; try at most these"
            )
