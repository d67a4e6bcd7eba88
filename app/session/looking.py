"""Named views of one browser: from above, from the sides, from the camera nodes, as opened, and fitted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from app.compute.records import SceneNode
from app.drawing.cameras import turn
from app.drawing.directions import Side, ball_m, fitting, forward_of
from app.session.framing import Framing
from packetmesh.errors import InputError
from pipeline.types import FloatArray

AHEAD_M = 0.2
"""Distance of the viewpoint in front of a camera node, metres. It is beyond the node's drawn picture, which
would otherwise fill the view."""


class Looking:
    """Turns the view of one browser to a named view."""

    def __init__(
        self, client: viser.ClientHandle, framing: Framing, on_turned: Callable[[], None] = lambda: None
    ) -> None:
        """Keep the browser and the session's ``framing``; ``on_turned`` is called after each turn."""
        self._client, self._framing, self._on_turned = client, framing, on_turned
        self._node = -1

    @property
    def nodes(self) -> tuple[SceneNode, ...]:
        """Return the camera nodes of the scene that is drawn; empty while something else is shown."""
        return self._framing.nodes

    def look(self, side: Side) -> None:
        """Look from a side, at the distance from which everything fits into the picture."""
        self._fit(forward_of(side, self._gaze()))

    def fit(self) -> None:
        """Keep the direction and fit everything into the picture. A vertical view becomes one from above."""
        camera = self._client.camera
        forward = np.asarray(camera.look_at, float) - np.asarray(camera.position, float)
        length = float(np.linalg.norm(forward))
        level = float(np.linalg.norm(forward[:2]))
        steep = length < 1e-9 or level < 0.01 * length
        self._fit(forward_of("above", self._gaze()) if steep else forward / length)

    def look_from(self, name: str) -> None:
        """Look from the camera node of this name.

        Raises:
            InputError: it is not drawn now.
        """
        nodes = {node.name: node for node in self.nodes}
        if name not in nodes:
            raise InputError(f"{name} is not drawn here; go to Scene, where every camera node is shown.")
        self._node = list(nodes).index(name)
        pose = nodes[name].T_world_camera
        points_m = nodes[name].sensor.points_m
        away_m = float(np.median(points_m[:, 2])) if len(points_m) else 1.0
        stand_m, center_m = (
            pose[:3, 3] + ahead_m * pose[:3, 2] for ahead_m in (AHEAD_M, max(away_m, 2.0 * AHEAD_M))
        )
        self._turn(center_m, stand_m)

    def look_from_next(self, step: int = 1) -> str:
        """Look from the camera node ``step`` places after the last one. Returns its name.

        Raises:
            InputError: no camera node is drawn now.
        """
        if not self.nodes:
            raise InputError("No camera node is drawn here; go to Scene, where every camera node is shown.")
        name = self.nodes[(self._node + step) % len(self.nodes)].name
        self.look_from(name)
        return name

    def look_as_opened(self) -> None:
        """Return to the view to which the app itself turned last."""
        if self._framing.framed is not None:
            stand_m, center_m = self._framing.framed
            self._turn(center_m, stand_m)
            self._framing.forget_turned()

    def _gaze(self) -> FloatArray:
        """Return (3,) the mean direction of the camera nodes; without nodes, that of the app's own view."""
        if self.nodes:
            return np.asarray(np.mean([node.T_world_camera[:3, 2] for node in self.nodes], axis=0))
        framed = self._framing.framed
        return np.array([1.0, 0.0, 0.0]) if framed is None else framed[1] - framed[0]

    def _fit(self, forward: FloatArray) -> None:
        camera = self._client.camera
        framed = self._framing.framed
        clouds_m = self._framing.clouds_m
        if clouds_m:
            points_m = np.concatenate(clouds_m)
        elif framed is not None:
            points_m = ball_m(framed[1], framed[0], camera.fov, camera.aspect)
        else:
            return
        self._turn(*fitting(points_m, forward, camera.fov, camera.aspect))

    def _turn(self, center_m: FloatArray, stand_m: FloatArray) -> None:
        turn(self._client, center_m, stand_m)
        self._on_turned()
