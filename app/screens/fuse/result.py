"""The nodes' clouds, where registration or their own rough poses put them."""

from __future__ import annotations

import viser

from app.compute.records import DepthView
from app.drawing.clouds import add_cloud, clear
from app.drawing.poses import move
from app.screens.fuse.view import FuseView


class NodesDrawing:
    """The clouds of all nodes below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str) -> None:
        self._scene, self._below = scene, below
        self._view: FuseView | None = None
        self._clouds: list[viser.PointCloudHandle] = []

    def draw(self, depth: DepthView, view: FuseView) -> None:
        """Draw the nodes of the chain."""
        clear(self._scene, self._below)
        self._view = view
        self._clouds = [
            add_cloud(self._scene, f"{self._below}/{node.name}", node.fused, T)
            for node, T in zip(depth.nodes, view.registered, strict=True)
        ]

    def place(self, before: bool) -> None:
        """Move them to where the nodes were believed to stand, or to where registration puts them."""
        if self._view is None:
            return
        poses = self._view.believed if before else self._view.registered
        for handle, T in zip(self._clouds, poses, strict=True):
            move(handle, T)
