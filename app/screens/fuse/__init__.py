"""Fuse: how the nodes find their places, and up to four methods racing from the same start."""

from app.screens.fuse.panel import ADVANCED, FusePanel

__all__ = ["ADVANCED", "FusePanel"]
