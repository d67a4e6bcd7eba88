"""Place and aim of the chosen ghost as numbers, so that a ghost can be moved without a mouse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.window.ui import Ui
from pipeline.kernels.geometry import aim_deg, aimed, rigid
from pipeline.types import FloatArray

STEP_M, STEP_DEG = 0.05, 2.5
"""Steps of the arrow keys. They have as many decimals as the shown values, which the page sends back."""


class PoseByNumber:
    """Inputs that show a ghost's pose and change it."""

    def __init__(self, ui: Ui, on_change: Callable[[FloatArray], None]) -> None:
        """Add the inputs to the current container, hidden.

        Args:
            ui: panel of the browser.
            on_change: called with the (4, 4) pose after a number was changed.
        """
        self._on_change = on_change
        self._T: FloatArray = np.eye(4)
        self._floor_m = 0.0
        self._place = ui.gui.add_vector3(
            "Place (m)",
            (0.0, 0.0, 0.0),
            step=STEP_M,
            hint="x and y as on the floor plan, and the height above the floor.",
            visible=False,
        )
        self._aim = ui.gui.add_vector2(
            "Pan, tilt (°)",
            (0.0, 0.0),
            step=STEP_DEG,
            hint="Pan counts from the x axis, counter-clockwise from above; a negative tilt looks down. A "
            "change makes the camera level.",
            visible=False,
        )
        ui.when_changed(self._place, self._placed)
        ui.when_changed(self._aim, self._aimed)

    def show(self, T_world_camera: FloatArray, floor_m: float) -> None:
        """Show a pose.

        Args:
            T_world_camera: (4, 4) pose.
            floor_m: z of the floor.
        """
        self._T, self._floor_m = T_world_camera, floor_m
        x_m, y_m, z_m = T_world_camera[:3, 3].tolist()
        pan_deg, tilt_deg = aim_deg(T_world_camera)
        self._place.value = round(x_m, 2), round(y_m, 2), round(z_m - floor_m, 2)
        self._aim.value = round(pan_deg, 1), round(tilt_deg, 1)
        self._place.visible = self._aim.visible = True

    def hide(self) -> None:
        """Show nothing."""
        self._place.visible = self._aim.visible = False

    def _placed(self) -> None:
        x_m, y_m, height_m = self._place.value
        self._on_change(rigid(self._T[:3, :3], np.array([x_m, y_m, height_m + self._floor_m])))

    def _aimed(self) -> None:
        self._on_change(aimed(self._T[:3, 3], *self._aim.value))
