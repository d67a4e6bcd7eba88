"""Memory of this process: its peak, a limit on what it may take further, and what it gives back."""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil


def peak_memory_bytes() -> int:
    """Largest resident memory of this process so far.

    On Linux read from /proc, because there the resource usage of a process starts at its parent's.
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
    """Let the process take no more than so much memory beside what it has; more is a MemoryError.

    It counts addresses, which threads that run meanwhile share. Windows knows no such limit.
    """
    if sys.platform == "win32":
        yield
        return
    import resource

    def limit_to(sizes_bytes: list[int]) -> None:
        most = resource.getrlimit(resource.RLIMIT_AS)[1]
        known = [size for size in (*sizes_bytes, most) if size != resource.RLIM_INFINITY]
        with suppress(ValueError, OSError):  # a system that knows no such limit
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
"""What the process could take before the first who limits it, then what each of them lets it take."""
_limits_change = threading.Lock()


def share_arenas(count: int = 2) -> None:
    """Have all threads allocate from a few places, where one each leaves many half empty; glibc only."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, count)


def give_back_memory() -> None:
    """Return what is free to the system; glibc only."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


_M_ARENA_MAX = -8
