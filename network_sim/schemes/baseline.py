"""BASELINE: every image is uploaded, whatever it shows (SPEC 6.2)."""

from __future__ import annotations

import numpy as np


class Baseline:
    """Sends summaries as the others do, so that they compare, but nobody has to ask for an image."""

    asks = False

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """All that is offered, oldest first."""
        return list(range(len(cells)))

    def received(self, cell: int, now_ns: int) -> None:
        """Nothing is learnt."""

    def missed(self, cell: int, captured_ns: int) -> None:
        """Nothing was counted on."""
