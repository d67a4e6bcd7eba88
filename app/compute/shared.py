"""Answers that all sessions share: each is computed once and stored; the last used ones stay in memory."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.compute.turns import Turns

LIMIT_BYTES = 128 << 20
"""Limit of the answers in memory; those of one demo scene take 27 MB, those of a further radius 4 MB."""


class SharedViews:
    """Views of steps and answers of quick jobs, each under its key: all that the answer depends on."""

    def __init__(self, store: Store, limit_bytes: int = LIMIT_BYTES) -> None:
        self.turns = Turns()
        self.on_surface: Callable[[Spec, Any], None] = lambda spec, view: None
        """Called each time that the complete surface of a spec is known."""
        self._store, self._limit_bytes = store, limit_bytes
        self._views: OrderedDict[Hashable, tuple[int, Any]] = OrderedDict()
        self._bytes = 0
        self._lock = threading.Lock()

    def get(self, key: Hashable) -> Any:
        """Return the answer with this key from memory or the store; None if it is in neither.

        If several sessions need it at once, only one reads the file.
        """
        with self._lock:
            if key in self._views:
                self._views.move_to_end(key)
                return self._views[key][1]
            view = self._store.get(kept(key))
            if view is not None:
                self._keep(key, view)
            return view

    def put(self, key: Hashable, view: Any) -> None:
        """Keep an answer in memory; over the limit, the least recently used answers leave the memory."""
        with self._lock:
            self._keep(key, view)

    def _keep(self, key: Hashable, view: Any) -> None:
        size = size_bytes(view)
        self._bytes += size - self._views.pop(key, (0, None))[0]
        self._views[key] = (size, view)
        while self._bytes > self._limit_bytes and len(self._views) > 1:
            self._bytes -= self._views.popitem(last=False)[1][0]


def kept(key: Hashable) -> tuple[Hashable, ...]:
    """Return the key under which the store keeps an answer, distinct from those of the chain's stages."""
    return ("view", key)


def size_bytes(value: Any) -> int:
    """Return the approximate memory of a view in bytes: that of its arrays, files and texts."""
    if isinstance(value, np.ndarray):
        return int(value.nbytes)
    if isinstance(value, bytes | str):
        return len(value)
    if isinstance(value, Mapping):
        return sum(map(size_bytes, value.values()))
    if isinstance(value, Iterable):
        return sum(map(size_bytes, value))
    if is_dataclass(value):
        return sum(size_bytes(getattr(value, part.name)) for part in fields(value))
    return 8
