"""Protocol of a recording: frames of one camera in order of time; how they are read ahead and chosen."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future
from typing import Protocol

import numpy as np

from pipeline.importing.recorded import DepthView
from pipeline.kernels.threads import threads
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


def read_ahead(
    recording: Recording, numbers: Iterable[int], ahead: int = 1
) -> Iterator[tuple[int, DepthView]]:
    """Yield frames' numbers and depth; the next ``ahead`` are read, in parallel, while the caller works."""
    reader = threads("recording", ahead)
    waiting: deque[tuple[int, Future[DepthView]]] = deque()
    for k in numbers:
        waiting.append((k, reader.submit(recording.view, k)))
        if len(waiting) > ahead:
            number, view = waiting.popleft()
            yield number, view.result()
    for number, view in waiting:
        yield number, view.result()


def spread(numbers: Sequence[int], most: int) -> list[int]:
    """Return at most ``most`` (two or more) evenly spaced items of a sequence, including both ends."""
    places = np.linspace(0, len(numbers) - 1, most).round().astype(int)
    return [numbers[place] for place in np.unique(places)] if numbers else []
