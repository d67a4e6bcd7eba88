"""Thread pools that are kept between calls: new threads for each call would have no memory to reuse
(``packetmesh bench --only chain``: a rig of three nodes took a fifth longer).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache


@cache
def threads(use: str, count: int) -> ThreadPoolExecutor:
    """Return the thread pool kept for one purpose; jobs in the same pool must not wait for each other."""
    return ThreadPoolExecutor(count, use)
