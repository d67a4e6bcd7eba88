"""The Depth screen."""

from app.panels.depth.panel import DepthPanel
from app.panels.depth.settings import ADVANCED, FIRST, TRUST

__all__ = ["ADVANCED", "FIRST", "TRUST", "DepthPanel"]
