"""What the Surface screen shows of the surfaces before and after fusion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.records import MeshView, SpacingView, Which
from app.screens.surface.holes_view import HoleView, PartsView
from app.screens.surface.sweep_view import SuggestionRow


@dataclass(frozen=True, slots=True)
class SurfaceView:
    """The surfaces before and after fusion; while they are computed, only what is there so far."""

    spacing: SpacingView
    radii_m: tuple[float, ...]
    after: MeshView
    before: MeshView | None
    elapsed_s: float
    """From the clouds to the surface after fusion."""
    holes: Mapping[Which, tuple[HoleView, ...]] = field(default_factory=dict)
    """Of both surfaces, at the end."""
    parts: PartsView | None = None
    """Of the surface after fusion."""
    suggestions: tuple[SuggestionRow, ...] = ()
    """Ball radii that the cloud after fusion suggests."""
