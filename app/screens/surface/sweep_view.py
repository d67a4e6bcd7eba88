"""What the app shows of ball radii: which are suggested, and what each of a sweep does."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SuggestionRow:
    """A ball radius with a meaning, as ``pipeline.surface.advice.Suggestion`` gives it."""

    name: str
    radius_m: float
    share: float
    """Share of the sampled surface points, borders left out, whose fan of triangles this ball closes."""
    sentence: str


@dataclass(frozen=True, slots=True)
class SweepRow:
    """The surface that one ball leaves, as ``pipeline.surface.sweep.SweepPoint`` measures it."""

    radius_m: float
    triangles: int
    unused_share: float
    hole_area_m2: float
    no_hit_ray_share: float
    accuracy_1cm: float
    """This and the next: NaN without truth or without a triangle."""
    f_score_5cm: float
    elapsed_s: float
    """Of the ball alone."""


@dataclass(frozen=True, slots=True)
class SweepView:
    """The balls of a sweep; while it runs, those that have rolled."""

    points: tuple[SweepRow, ...]
    """By radius, ascending."""
    r_F_m: float
    sigma_D_m: float
    planned: int
    """How many balls there will be."""

    @property
    def done(self) -> bool:
        """Whether all of them have rolled."""
        return len(self.points) == self.planned
