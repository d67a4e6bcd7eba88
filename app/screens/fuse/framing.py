"""The view of a race: so narrow that all lanes are seen from the same side."""

from __future__ import annotations

from collections.abc import Iterable

import viser

from app.screens.fuse.draw import RaceDrawing


class RaceFraming:
    """Narrows the view of browsers to a race, and gives them back the angle that they had."""

    def __init__(self) -> None:
        self._shapes: tuple[tuple[int, float, int], ...] = ()
        self._fov_rad: float | None = None

    def anew(self) -> None:
        """Something else is to be framed."""
        self._shapes = ()

    def frame(self, drawing: RaceDrawing, clients: Iterable[viser.ClientHandle]) -> None:
        """Have all lanes in the picture, once for each shape of the windows."""
        clients = list(clients)
        shapes = tuple(
            (client.client_id, round(client.camera.aspect, 2), client.camera.image_height)
            for client in clients
        )
        if shapes != self._shapes and clients:
            if self._fov_rad is None:
                self._fov_rad = clients[0].camera.fov
            self._shapes = shapes
            drawing.look(clients)

    def widen(self, clients: Iterable[viser.ClientHandle]) -> None:
        """Give the view back the angle that a race narrows."""
        if self._fov_rad is not None:
            for client in clients:
                client.camera.fov = self._fov_rad
            self._fov_rad, self._shapes = None, ()
