"""Memory of this process: its peak, a limit on further allocations, and the return of free memory."""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil


def peak_memory_bytes() -> int:
    """Return the largest resident memory of this process so far.

    On Linux it is read from /proc, because resource usage there starts from the parent process's peak.
    """
    if sys.platform == "win32":
        return int(psutil.Process().memory_info().peak_wset)
    record = Path("/proc/self/status")
    if record.exists():
        lines = dict(line.split(":", 1) for line in record.read_text().splitlines() if ":" in line)
        return 1024 * int(lines["VmHWM"].split()[0])
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else peak * 1024)


@contextmanager
def at_most_further(size_bytes: int) -> Iterator[None]:
    """Limit what the process may allocate in addition to its present memory; more raises a MemoryError.

    The limit is on address space, shared by all threads. Windows has no such limit: nothing happens there.
    """
    if sys.platform == "win32":
        yield
        return
    import resource

    def limit_to(sizes_bytes: list[int]) -> None:
        most = resource.getrlimit(resource.RLIMIT_AS)[1]
        known = [size for size in (*sizes_bytes, most) if size != resource.RLIM_INFINITY]
        with suppress(ValueError, OSError):  # a system without such a limit
            resource.setrlimit(resource.RLIMIT_AS, (min(known, default=resource.RLIM_INFINITY), most))

    mine = psutil.Process().memory_info().vms + size_bytes
    with _limits_change:
        if not _limits_bytes:
            _limits_bytes.append(resource.getrlimit(resource.RLIMIT_AS)[0])
        _limits_bytes.append(mine)
        limit_to(_limits_bytes)
    try:
        yield
    finally:
        with _limits_change:
            _limits_bytes.remove(mine)
            limit_to(_limits_bytes)
            if len(_limits_bytes) == 1:
                _limits_bytes.clear()


_limits_bytes: list[int] = []
"""Limit of the process before any call of ``at_most_further``, then the limit of each running call."""
_limits_change = threading.Lock()


def share_arenas(count: int = 2) -> None:
    """Make all threads allocate from ``count`` arenas, as one arena per thread leaves many half empty.

    Only glibc has arenas; with other libraries nothing happens.
    """
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, count)


def give_back_memory() -> None:
    """Return free memory to the system; nothing happens without glibc."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


_M_ARENA_MAX = -8
