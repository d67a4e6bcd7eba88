"""Interface of the schemes, and BASELINE, with which vehicles upload every image (SPEC 6.2)."""

from __future__ import annotations

import numpy as np


class Scheme:
    """Decides which of the offered images the collector requests."""

    asks = True
    """Vehicles upload images only on request."""

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Return the indices, in upload order, of the images to upload of those in a summary (T,)."""
        raise NotImplementedError

    def received(self, cell: int, now_ns: int) -> None:
        """Learn that an image arrived."""

    def missed(self, cell: int, captured_ns: int) -> None:
        """Learn that a requested image did not arrive."""


class Baseline(Scheme):
    """Uploads every image without a request; summaries are sent too, to be comparable."""

    asks = False

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Return the indices of all offered images, oldest first."""
        return list(range(len(cells)))
