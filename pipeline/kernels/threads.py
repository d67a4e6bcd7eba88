"""Threads beside the calling one that stay: a new one for each call would begin with no memory to use again
(``packetmesh bench --only chain``: a rig of three took a fifth more).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache


@cache
def threads(use: str, count: int) -> ThreadPoolExecutor:
    """Of one use, whose work must not wait for other work of the same use."""
    return ThreadPoolExecutor(count, use)
