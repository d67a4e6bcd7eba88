"""Protocol of a recording: frames of one camera in order of time; and the even choice of some of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from pipeline.importing.recorded import DepthView
from pipeline.types import FloatArray, RgbdFrame


class Recording(Protocol):
    """Frames of one camera in order of time, read only when they are requested."""

    @property
    def name(self) -> str:
        """Name to display."""
        ...

    @property
    def times_s(self) -> FloatArray:
        """(N,) time of each frame, ascending."""
        ...

    @property
    def T_world_camera(self) -> tuple[FloatArray | None, ...] | None:
        """(4, 4) poses of the colour camera that came with the frames; None if none is known."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions, one sentence each."""
        ...

    def view(self, index: int) -> DepthView:
        """Read the depth of a frame, without its colour."""
        ...

    def frame(self, index: int) -> RgbdFrame:
        """Read colour and depth of a frame on one pixel grid."""
        ...


def spread(numbers: Sequence[int], most: int) -> list[int]:
    """Return at most ``most`` (two or more) evenly spaced items of a sequence, including both ends."""
    places = np.linspace(0, len(numbers) - 1, most).round().astype(int)
    return [numbers[place] for place in np.unique(places)] if numbers else []
