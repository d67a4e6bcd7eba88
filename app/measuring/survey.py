"""Marks and planes of a surface, each computed once, because requests repeat the same clicks."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from app.compute.measures import Place
from packetmesh.errors import InputError
from pipeline.measuring.marks import Mark, Snap, mark
from pipeline.measuring.measures import Measure, ScaleCheck, with_scale
from pipeline.measuring.planes import Plane, plane_at
from pipeline.measuring.surface import MeasuredSurface

Found = TypeVar("Found")


class Survey:
    """Marks and planes found on one surface, at its own scale or at another one."""

    def __init__(self, surface: MeasuredSurface, factor: float = 1.0) -> None:
        """Begin with nothing; ``factor`` is the surface's size over that of the drawn one."""
        self.surface, self.factor = surface, factor
        self._found: dict[Hashable, object] = {}

    def mark(self, place: Place, snap: Snap) -> Mark:
        """Return the mark at a place of the drawn surface; raises like ``pipeline.measuring.marks.mark``."""
        point_m = self.factor * np.array(place)
        return self._once((place, snap), lambda: mark(self.surface, point_m, snap))

    def plane(self, place: Place) -> Plane:
        """Return the plane at a place of the drawn surface; raises like ``plane_at``."""
        point_m = self.factor * np.array(place)
        return self._once(place, lambda: plane_at(self.surface, point_m))

    def scaled(self, true_m: float, measured: Measure) -> tuple[Survey, ScaleCheck]:
        """Return the surface at the scale of a true length; raises like ``with_scale``."""

        def scale() -> tuple[Survey, ScaleCheck]:
            surface, check = with_scale(self.surface, true_m, measured)
            return Survey(surface, self.factor * check.factor), check

        return self._once((true_m, measured.values), scale)

    def _once(self, key: Hashable, find: Callable[[], Found]) -> Found:
        """Return the cached result of ``find`` for this key; an ``InputError`` is cached and raised, too."""
        if key not in self._found:
            try:
                self._found[key] = find()
            except InputError as error:
                self._found[key] = error
        found = self._found[key]
        if isinstance(found, InputError):
            raise InputError(str(found))
        return found  # type: ignore[return-value]


_surveys: WeakKeyDictionary[MeasuredSurface, Survey] = WeakKeyDictionary()


def survey_of(surface: MeasuredSurface) -> Survey:
    """Return this process's survey of a surface."""
    if surface not in _surveys:
        _surveys[surface] = Survey(surface)
    return _surveys[surface]
