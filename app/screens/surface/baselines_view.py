"""What the browser gets of a surface that another method made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.records import MeshView

BaselineName = Literal["poisson", "alpha"]


@dataclass(frozen=True, slots=True)
class BaselineView:
    """The surface of another method over the same points, to hold the ball's against."""

    name: BaselineName
    mesh: MeshView
    elapsed_s: float
    """From the cloud to the surface, without the measures."""
    note: str
    """One sentence on the method and its parameters."""
