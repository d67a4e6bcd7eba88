"""A random generator whose first numbers, the backoffs, a test chooses."""

from __future__ import annotations

from typing import Any

import numpy as np


class FixedBackoffs(np.random.Generator):
    """Gives the chosen backoffs first, then zeros."""

    def __init__(self, *slots: int) -> None:
        super().__init__(np.random.PCG64(0))
        self._slots = list(slots)

    def integers(self, *_: Any, size: int = 1, **__: Any) -> np.ndarray:
        chosen, self._slots = self._slots, []
        return np.array(chosen + [0] * size)
