"""What the colours of a delivery in the room mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.drawing.colors import LOSS
from app.screens.network.delivery_draw import BUSY, DOWN, EMPTY, FULL, Number
from app.screens.network.delivery_view import DeliveryView
from app.screens.network.labels import ANSWER, PACKET_COLORS, PACKET_NAMES
from app.screens.network.view import What


def legend(view: DeliveryView) -> Sequence[tuple[str, Number]]:
    """What the colours of the stage mean."""
    some = [("camera, nothing arrived", BUSY), ("camera, all arrived", FULL)]
    if any(node.row < 0 for node in view.nodes):
        some.append(("camera down", DOWN))
    pieces = view.run.pieces
    flying = [
        (f"{name} on its way", PACKET_COLORS[kind])
        for kind, name in PACKET_NAMES.items()
        if np.any((pieces.what == What.AIR) & (pieces.carries == kind))
    ]
    if np.any(pieces.what == What.ACK):
        flying.append(("acknowledgement on its way", ANSWER))
    most = "empty battery" if view.sent.network.energy.battery_j else "most energy used here"
    return [*some, *flying, ("lost here", LOSS), (f"ball: from little to {most}", EMPTY)]


def most_j(view: DeliveryView) -> float:
    """What a node's battery holds; without one, the most that any node uses until the last moment."""
    battery_j = view.sent.network.energy.battery_j
    used_j = [node.energy_j for moment in view.moments for node in moment.nodes]
    return max(used_j, default=0.0) if battery_j is None else battery_j
