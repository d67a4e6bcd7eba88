"""Times and sizes of the images of a node that takes each at a time of its own."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from packetmesh.checks import at_least, finite
from packetmesh.errors import InputError


def check_image_times(times_s: Sequence[float], sizes: Sequence[int], images: int, count: int) -> None:
    """Check the times and sizes of the images of the only node.

    Args:
        times_s: (I,) times of the images; empty if they are taken at regular intervals.
        sizes: (I,) their bytes.
        images: number of images of each node.
        count: number of nodes.

    Raises:
        InputError: the numbers of times, sizes and images differ, there are several nodes, or a value is out
            of range.
    """
    if not times_s and not sizes:
        return
    if not len(times_s) == len(sizes) == images:
        raise InputError(
            f"nodes.image_times_s has {len(times_s)} numbers, nodes.bytes_by_image {len(sizes)}, and "
            f"nodes.images is {images}; try one time and one size for each image"
        )
    if count != 1:
        raise InputError(
            f"nodes.image_times_s are the times of one node's images, but nodes.count is {count}; try "
            "nodes.count=1"
        )
    finite("nodes.image_times_s", times_s, "seconds")
    at_least("nodes.image_times_s", times_s[0], 0.0)
    at_least("nodes.bytes_by_image", min(sizes), 1)
    if any(later < earlier for earlier, later in pairwise(times_s)):
        raise InputError(f"nodes.image_times_s is {times_s}, which falls; try the times in rising order")
