"""Thread pools that stay: a new thread for each call would start without memory to reuse
(``packetmesh bench --only chain``: a rig of three took a fifth more).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache


@cache
def threads(use: str, count: int) -> ThreadPoolExecutor:
    """Return the thread pool kept for one purpose; jobs in the same pool must not wait for each other."""
    return ThreadPoolExecutor(count, use)
