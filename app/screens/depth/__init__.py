"""The Depth screen."""

from app.screens.depth.panel import DepthPanel
from app.screens.depth.settings import ADVANCED, CONFIDENCE_CONTROLS, FIRST

__all__ = ["ADVANCED", "CONFIDENCE_CONTROLS", "FIRST", "DepthPanel"]
