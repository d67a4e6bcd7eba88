"""BASELINE: every image is uploaded, whatever it shows (SPEC 6.2)."""

from __future__ import annotations

import numpy as np


class Baseline:
    """Sends summaries as the other schemes do, to be comparable, but images need no request."""

    asks = False

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """All offered images, oldest first."""
        return list(range(len(cells)))

    def received(self, cell: int, now_ns: int) -> None:
        """BASELINE keeps no state."""

    def missed(self, cell: int, captured_ns: int) -> None:
        """BASELINE keeps no state."""
