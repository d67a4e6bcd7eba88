"""Chance that is not: backoffs as a test wants them."""

from __future__ import annotations

from typing import Any

import numpy as np


class Dealt(np.random.Generator):
    """Deals the given backoffs first, then zeros."""

    def __init__(self, *slots: int) -> None:
        super().__init__(np.random.PCG64(0))
        self._slots = list(slots)

    def integers(self, *_: Any, size: int = 1, **__: Any) -> np.ndarray:
        dealt, self._slots = self._slots, []
        return np.array(dealt + [0] * size)
