"""Anderson acceleration of a sequence of poses."""

from __future__ import annotations

from pipeline.types import FloatArray


class Anderson:
    """Extrapolates from the last poses and their updates."""

    def mix(self, T_current: FloatArray, T_proposed: FloatArray) -> FloatArray:
        """The next pose."""
        return T_proposed

    def reset(self) -> None:
        """Forget the past."""
