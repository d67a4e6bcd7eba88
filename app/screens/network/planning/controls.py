"""Controls of the folder *Plan*: how many cameras, where, which, and within which limits."""

from __future__ import annotations

import math
from typing import Any

from app.compute.state import Sent
from app.screens.network.place import show, shown, text_of, values_of
from app.screens.network.planning.labels import MATERIALS, SENSORS, WHERES
from app.screens.network.planning.view import PlanRequest
from app.window.ui import Ui
from packetmesh.errors import InputError

MOST_CAMERAS = 4
LIMITS = {"budget": ("The budget", "J"), "deadline": ("The deadline", "s")}
SENSOR_NAMES = {title: name for name, title in SENSORS.items()}
MATERIAL_NAMES = {title: name for name, title in MATERIALS.items()}


class PlanControls:
    """Inputs of a plan, with their values in the address."""

    def __init__(self, ui: Ui) -> None:
        """Add the controls to the current container."""
        gui = ui.gui
        self._cameras = gui.add_slider(
            "New cameras", 1, MOST_CAMERAS, 1, 1, hint="Number of cameras to be added."
        )
        self._where = {
            kind: gui.add_checkbox(title, True, hint="Whether a new camera may stand there.")
            for kind, title in WHERES.items()
        }
        self._sensor = gui.add_dropdown(
            "Sensor",
            list(SENSOR_NAMES),
            hint="Lens and range of the new cameras. As the present ones: the lens of the first node and the "
            "range of a Kinect v1.",
        )
        self._walls = gui.add_dropdown(
            "Walls of",
            list(MATERIAL_NAMES),
            initial_value=MATERIALS["brick"],
            hint="Material of the walls that are found in the surface: concrete damps the radio most, "
            "plaster least.",
        )
        self._dark = gui.add_checkbox(
            "Dark surface counts",
            True,
            hint="Whether surface counts that looks dark to a present sensor, such as a screen; a camera of "
            "the same kind may get no depth there, either.",
        )
        self._limits = {
            "budget": gui.add_text(
                "Budget (J)",
                "",
                hint="Largest energy for one image of every new camera, all together; empty: no limit.",
            ),
            "deadline": gui.add_text(
                "Deadline (s)",
                "",
                hint="Latest time at which 99 % of each new image must be at the sink; empty: no limit.",
            ),
        }
        self._start = self._values()

    def request(self, sent: Sent) -> PlanRequest:
        """Return the request that the controls make, for a delivery with the screen's settings.

        Raises:
            InputError: budget or deadline is not a number above 0.
        """
        where = tuple(kind for kind, box in self._where.items() if box.value)
        limits = {name: _limit(name, handle.value) for name, handle in self._limits.items()}
        return PlanRequest(
            sent,
            int(self._cameras.value),
            where,
            SENSOR_NAMES[self._sensor.value],
            limits["budget"],
            limits["deadline"],
            MATERIAL_NAMES[self._walls.value],
            self._dark.value,
        )

    def place(self) -> str:
        """Return the values that differ from the first ones as text for the address."""
        return text_of(self._values(), self._start)

    def take(self, place: str) -> None:
        """Set the controls from an address.

        Raises:
            InputError: some of the text is unknown; all else is set.
        """
        values, wrong, handles = self._start | values_of(place), list[InputError](), self._handles()
        for name, text in values.items():
            try:
                if name in LIMITS:
                    _limit(name, text)
                    self._limits[name].value = text
                elif name == "sensor":
                    show(name, self._sensor, SENSORS.get(text, text))
                elif name == "material":
                    show(name, self._walls, MATERIALS.get(text, text))
                elif name in handles:
                    show(name, handles[name], text)
                else:
                    raise InputError(f"The address has {name[:40]}, no control of Plan; leave it out")
            except InputError as error:
                wrong.append(error)
        if wrong:
            raise wrong[0]

    def _handles(self) -> dict[str, Any]:
        return {"cameras": self._cameras, **self._where, "dark": self._dark}

    def _values(self) -> dict[str, str]:
        texts = {name: shown(handle) for name, handle in self._handles().items()}
        texts["sensor"] = SENSOR_NAMES[self._sensor.value]
        texts["material"] = MATERIAL_NAMES[self._walls.value]
        return texts | {name: handle.value.strip() for name, handle in self._limits.items()}


def _limit(name: str, text: str) -> float | None:
    """Return a limit; None if the text is empty."""
    if not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        what, unit = LIMITS[name]
        raise InputError(f"{what} is {text.strip()[:40]!r}; try a number above 0 ({unit}), or nothing")
    return value
