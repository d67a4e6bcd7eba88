"""What a scheme decides; and BASELINE, with which every image is uploaded, whatever it shows (SPEC 6.2)."""

from __future__ import annotations

import numpy as np


class Scheme:
    """Decides which of the offered images the collector requests."""

    asks = True
    """Images come only on request."""

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Positions of the images to upload, in that order, of those that a summary offers (T,)."""
        raise NotImplementedError

    def received(self, cell: int, now_ns: int) -> None:
        """An image arrived."""

    def missed(self, cell: int, captured_ns: int) -> None:
        """A requested image did not arrive."""


class Baseline(Scheme):
    """Sends summaries as the other schemes do, to be comparable, but images need no request."""

    asks = False

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """All offered images, oldest first."""
        return list(range(len(cells)))
