"""Surface: a ball rolls over the points; its radius decides what becomes a surface and what a hole."""

from app.panels.surface.panel import SurfacePanel
from app.panels.surface.settings import ADVANCED

__all__ = ["ADVANCED", "SurfacePanel"]
