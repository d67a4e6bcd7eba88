"""Memory of this process: its peak, a limit on what it may take further, and what it gives back."""

from __future__ import annotations

import ctypes
import sys
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

    before, most = resource.getrlimit(resource.RLIMIT_AS)
    limit = psutil.Process().memory_info().vms + size_bytes
    for known in (before, most):
        limit = limit if known == resource.RLIM_INFINITY else min(limit, known)
    with suppress(ValueError, OSError):  # a system that knows no such limit
        resource.setrlimit(resource.RLIMIT_AS, (limit, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (before, most))


def share_arenas(count: int = 2) -> None:
    """Have all threads allocate from a few places, where one each leaves many half empty; glibc only."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, count)


def give_back_memory() -> None:
    """Return what is free to the system; glibc only."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


_M_ARENA_MAX = -8
