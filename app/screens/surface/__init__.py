"""Surface: a ball rolls over the points; its radius decides what becomes a surface and what a hole."""

from app.screens.surface.panel import SurfacePanel
from app.screens.surface.settings import ADVANCED

__all__ = ["ADVANCED", "SurfacePanel"]
