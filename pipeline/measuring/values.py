"""Results of measurements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pipeline.types import FloatArray

Kind = Literal["distance", "point-plane", "plane-plane", "angle", "hole", "box"]
Unit = Literal["m", "deg", "m2"]


@dataclass(frozen=True, slots=True)
class Value:
    """A number with its interval."""

    name: str
    """``length``, ``distance``, ``angle``, ``area``, ``width``, ``depth`` or ``height``."""
    value: float
    unit: Unit
    ci95: tuple[float, float]
    """95 % interval, in the same unit."""
    guessed: bool
    """Whether an end was guessed, so that the interval comes from the odds of such guesses."""


@dataclass(frozen=True, slots=True)
class Measure:
    """The result of one measurement."""

    kind: Kind
    values: tuple[Value, ...]
    """Three for a box, else one."""
    ends_m: FloatArray
    """(K, 3) points for drawing: two ends; three points of an angle, its corner in the middle; the eight
    corners of a box; the rim of a hole in order."""

    def records(self) -> list[dict[str, object]]:
        """Return the values as plain records for JSON."""
        return [
            {
                "kind": self.kind,
                "name": one.name,
                "value": one.value,
                "unit": one.unit,
                "ci95": list(one.ci95),
                "guessed": one.guessed,
            }
            for one in self.values
        ]
