"""How much a browser may upload, counted before it is kept: viser itself would take any amount."""

from __future__ import annotations

import time
from collections import deque

MOST_BYTES = 256 << 20
"""Of one file; screens may take less."""
MOST_TOTAL_BYTES = 1 << 30
"""Of all files of a session."""
MOST_PARTS = 10_000
MOST_A_MINUTE = 300
REFUSED = (
    f"The app takes files of up to {MOST_BYTES >> 20} MB, {MOST_TOTAL_BYTES >> 30} GB in all, and "
    f"{MOST_A_MINUTE} a minute: reload the page to begin anew, or use the command line."
)


class UploadGate:
    """What one browser has sent so far."""

    def __init__(self) -> None:
        self._left: dict[str, int] = {}
        """Bytes that are still to come, by transfer."""
        self._total = 0
        self._begun_s: deque[float] = deque(maxlen=MOST_A_MINUTE)

    def begins(self, size_bytes: int, parts: int, transfer: str) -> bool:
        """Whether a file of that size may come; it counts from then on."""
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
        """Whether a part belongs to a file that may come, and is not more than it said."""
        left = self._left.get(transfer, -1) - size_bytes
        self._left[transfer] = left
        return left >= 0
