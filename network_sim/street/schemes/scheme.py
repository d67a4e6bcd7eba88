"""Interface of the schemes, and BASELINE, with which vehicles upload every image (SPEC 6.2)."""

from __future__ import annotations

import numpy as np

from network_sim.street.pieces import Part


class Scheme:
    """Decides which of the offered images the collector requests."""

    on_request = True
    """Vehicles upload images only on request."""
    by_pieces = False
    """Requests name pieces of images instead of whole images."""

    def parts(self, shown: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[Part]:
        """Return the parts of images to upload, in upload order, of those in a summary (T,).

        Args:
            shown: (T,) cells of the images, or (T, P) pieces of road ``by_pieces``.
            captured_ns: (T,) capture times of the images.
            now_ns: present time.
        """
        chosen = self.chosen(shown, captured_ns, now_ns)
        cells = shown[chosen].tolist()
        return [Part(index, (cell,)) for index, cell in zip(chosen, cells, strict=True)]

    def chosen(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Return the indices of the images to upload, in upload order, of those in a summary (T,).

        Args:
            cells: (T,) cells of the images.
            captured_ns: (T,) capture times of the images.
            now_ns: present time.
        """
        raise NotImplementedError

    def received(self, cell: int, now_ns: int) -> None:
        """Record that an image of this cell arrived; most schemes ignore it."""

    def missed(self, cell: int, captured_ns: int) -> None:
        """Record that a requested image of this cell, captured at ``captured_ns``, did not arrive."""


class Baseline(Scheme):
    """Uploads every image without a request; summaries are sent too, to be comparable."""

    on_request = False

    def chosen(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Return the indices of all offered images, oldest first."""
        return list(range(len(cells)))
