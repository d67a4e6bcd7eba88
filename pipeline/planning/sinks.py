"""Choice of the place of the sink from which the weakest radio link to a camera is the strongest."""

from __future__ import annotations

import numpy as np

from network_sim.config import RadioConfig
from network_sim.radio.propagation import path_loss, ratio, walls_crossed
from packetmesh.errors import InputError
from pipeline.planning.places import WHERES, free_places
from pipeline.planning.seen import SeenPlace
from pipeline.types import FloatArray

APART_M = 0.3
"""Least distance on the floor plan of the best sink from every camera: both need room."""


def best_sink(seen: SeenPlace, cameras_m: FloatArray, radio: RadioConfig) -> FloatArray:
    """Return (2,) x and y of the place whose weakest link to a camera is the strongest.

    The sink may stand wherever a camera could, on walls, ceiling, furniture and tripods, but not where one
    stands.

    Args:
        seen: the place.
        cameras_m: (N, 2) x and y of all cameras.
        radio: path loss, and the walls that damp the links.

    Raises:
        InputError: the surface has no free place, or cameras stand at all of them.
    """
    places_m = np.vstack([np.reshape(list(free_places(seen, kind)), (-1, 3))[:, :2] for kind in WHERES])
    if not len(places_m):
        raise InputError("The surface has no free place for a sink; give its x and y")
    away_m = np.linalg.norm(places_m[:, None] - cameras_m, axis=2).min(axis=1)
    places_m = places_m[away_m >= APART_M]
    if not len(places_m):
        raise InputError(
            f"A camera stands within {APART_M:g} m of every free place for a sink; give its x and y"
        )
    weakest_w = [weakest_link_w(place_m, cameras_m, radio) for place_m in places_m]
    best: FloatArray = places_m[int(np.argmax(weakest_w))]
    return best


def weakest_link_w(sink_m: FloatArray, cameras_m: FloatArray, radio: RadioConfig) -> float:
    """Return the least mean power, in watts, that a sink at (2,) receives from a camera."""
    loss, walls_m = path_loss(radio), np.reshape(radio.walls_m, (-1, 2, 2))
    x_m, y_m = sink_m.tolist()
    return min(
        loss.power_w(float(np.hypot(at_x_m - x_m, at_y_m - y_m)))
        * ratio(-radio.wall_db * walls_crossed(walls_m, (at_x_m, at_y_m), (x_m, y_m)))
        for at_x_m, at_y_m in cameras_m.tolist()
    )
