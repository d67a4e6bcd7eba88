"""Protocol of a recording: frames of one camera in order of time."""

from __future__ import annotations

from typing import Protocol

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
