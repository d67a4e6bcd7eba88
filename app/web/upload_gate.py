"""Limits on what a browser may upload, counted before the data is kept; viser takes any amount."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass

MOST_BYTES = 256 << 20
"""Largest file, bytes; screens may have lower limits."""
MOST_TOTAL_BYTES = 1 << 30
"""Most bytes of all files of one connection."""
LEAST_PART_BYTES = 64 << 10
"""What each part of a file, and a file without parts, counts at least: the server keeps a record of it."""
MOST_A_MINUTE = 300
REFUSED = (
    f"The app takes files of up to {MOST_BYTES >> 20} MB, {MOST_TOTAL_BYTES >> 30} GB in all, and "
    f"{MOST_A_MINUTE} a minute: reload the page to reset these limits, or use the command line."
)


@dataclass(slots=True)
class _Left:
    """What is still to come of an accepted file."""

    size_bytes: int
    parts: int


class UploadGate:
    """Counts what one connection uploads."""

    def __init__(self) -> None:
        self._left: dict[str, _Left] = {}
        """By transfer, of which a complete one stays known: it cannot begin again."""
        self._total = 0
        self._begun_s: deque[float] = deque(maxlen=MOST_A_MINUTE)

    def begins(self, size_bytes: int, parts: int, transfer: str) -> bool:
        """Whether a file of this size may be uploaded; an accepted file is counted at once."""
        now_s = time.monotonic()
        too_often = len(self._begun_s) == MOST_A_MINUTE and now_s - self._begun_s[0] < 60.0
        if too_often or parts < 0 or not 0 <= size_bytes <= MOST_BYTES or transfer in self._left:
            return False
        counted_bytes = max(size_bytes, LEAST_PART_BYTES * max(parts, 1))
        if self._total + counted_bytes > MOST_TOTAL_BYTES:
            return False
        self._begun_s.append(now_s)
        self._total += counted_bytes
        self._left[transfer] = _Left(size_bytes, parts)
        return True

    def awaits(self, transfer: object) -> bool:
        """Whether a transfer is that of an accepted file with parts still to come."""
        return isinstance(transfer, str) and transfer in self._left and self._left[transfer].parts > 0

    def goes_on(self, transfer: str, size_bytes: int) -> bool:
        """Whether a part belongs to an accepted file and keeps within the announced size and parts."""
        if not self.awaits(transfer):
            return False
        left = self._left[transfer]
        left.size_bytes -= size_bytes
        left.parts = left.parts - 1 if left.size_bytes >= 0 else 0
        return left.size_bytes >= 0
