"""Depth cameras that can be planned: their lens, range, and distance to a projector or second lens."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from packetmesh.errors import InputError
from pipeline.types import CameraIntrinsics, Rig

FADE_SHARE = 0.12
"""Share of the range over which returns become rare before its end (a Kinect's last .6 of 4.5 m)."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """A depth camera as the planner sees it."""

    name: str
    intrinsics: CameraIntrinsics
    """Lens of its registered images."""
    near_m: float
    far_m: float
    """Least and greatest depth that it measures."""
    baseline_m: float
    """Distance from the camera to its projector or second camera, on its right: what only one of
    both sees has no depth. 0 for time of flight."""


def _lens(width_px: int, height_px: int, focal_px: float) -> CameraIntrinsics:
    middle = 0.5 * (width_px - 1), 0.5 * (height_px - 1)
    return CameraIntrinsics.pinhole(focal_px, focal_px, *middle, width_px, height_px)


SENSORS = {
    sensor.name: sensor
    for sensor in (
        Sensor("kinect-v1", _lens(640, 480, 525.0), 0.4, 4.5, 0.075),
        Sensor("kinect-v2", _lens(512, 424, 365.0), 0.5, 4.5, 0.0),
        Sensor("azure-kinect", _lens(640, 576, 504.0), 0.5, 3.86, 0.0),
        Sensor("realsense-d435", _lens(848, 480, 425.0), 0.2, 6.0, 0.05),
    )
}
"""Cameras by name. Lens and range: Kinect v1 (Khoshelham and Elberink 2012), Kinect v2, Azure Kinect in NFOV
unbinned, RealSense D435 at 848 x 480, from their makers' data sheets, from memory. Loss by angle and darkness
is that of a Kinect v1 for all."""

AS_PRESENT = "as-present"
"""Name of the sensor that the rig has already."""


def sensor_named(name: str, rig: Rig) -> Sensor:
    """Return a sensor by name; ``as-present`` is a Kinect v1 with the lens of the rig's first node.

    Raises:
        InputError: there is no sensor of that name.
    """
    if name == AS_PRESENT:
        first, kinect = rig.frames[0], SENSORS["kinect-v1"]
        return Sensor(
            AS_PRESENT,
            first.intrinsics,
            kinect.near_m,
            kinect.far_m,
            kinect.baseline_m,
        )
    check_sensor(name)
    return SENSORS[name]


def check_sensor(name: str) -> None:
    """Check the name of a sensor.

    Raises:
        InputError: there is no sensor of that name.
    """
    if name not in sensor_names():
        raise InputError(f"There is no sensor {name!r}; try one of {', '.join(sensor_names())}")


def sensor_names() -> Sequence[str]:
    """Return the names that ``sensor_named`` takes."""
    return (AS_PRESENT, *SENSORS)
