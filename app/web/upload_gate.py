"""Limits on what a browser may upload, counted before the data is kept; viser takes any amount."""

from __future__ import annotations

import time
from collections import deque

MOST_BYTES = 256 << 20
"""Largest file, bytes; screens may have lower limits."""
MOST_TOTAL_BYTES = 1 << 30
"""Most bytes of all files of one connection."""
MOST_PARTS = 10_000
"""Most parts of a file."""
MOST_A_MINUTE = 300
REFUSED = (
    f"The app takes files of up to {MOST_BYTES >> 20} MB, {MOST_TOTAL_BYTES >> 30} GB in all, and "
    f"{MOST_A_MINUTE} a minute: reload the page to begin anew, or use the command line."
)


class UploadGate:
    """Counts what one connection uploads."""

    def __init__(self) -> None:
        self._left: dict[str, int] = {}
        """Bytes still to come, by transfer."""
        self._total = 0
        self._begun_s: deque[float] = deque(maxlen=MOST_A_MINUTE)

    def begins(self, size_bytes: int, parts: int, transfer: str) -> bool:
        """Whether a file of this size may be uploaded; an accepted file is counted at once."""
        now_s = time.monotonic()
        too_often = len(self._begun_s) == MOST_A_MINUTE and now_s - self._begun_s[0] < 60.0
        too_much = not 0 <= size_bytes <= min(MOST_BYTES, MOST_TOTAL_BYTES - self._total)
        if too_often or too_much or not 0 <= parts <= MOST_PARTS or transfer in self._left:
            return False
        self._begun_s.append(now_s)
        self._total += size_bytes
        self._left[transfer] = size_bytes
        return True

    def goes_on(self, transfer: str, size_bytes: int) -> bool:
        """Whether a part belongs to an accepted file and keeps within the announced size."""
        left = self._left.get(transfer, -1) - size_bytes
        self._left[transfer] = left
        return left >= 0
