"""Network: nodes, packets and what their ways cost, on one timeline."""

from app.screens.network.panel import NetworkPanel

__all__ = ["NetworkPanel"]
