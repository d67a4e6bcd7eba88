"""What the address says of a surface: which one, and in which colours."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.screens.surface.labels import COLORINGS, PLACES
from app.window.in_address import InAddress, Picked


def picked(
    shown: viser.GuiDropdownHandle[str],
    on_shown: Callable[[], None],
    coloring: viser.GuiDropdownHandle[str],
    on_coloring: Callable[[], None],
) -> dict[str, InAddress]:
    """The lists of the screen, each with what answers a change of it, by their keys in the address."""
    colors: dict[str, str] = {key: label for label, key in COLORINGS.items()}
    return {"surface": Picked(shown, PLACES, on_shown), "color": Picked(coloring, colors, on_coloring)}
