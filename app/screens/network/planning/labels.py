"""Names of sensors and places, and texts of the folder *Plan*."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from app.web.markup import Markdown

SENSORS: Mapping[str, str] = MappingProxyType(
    {
        "as-present": "As the present ones",
        "kinect-v1": "Kinect v1",
        "kinect-v2": "Kinect v2",
        "azure-kinect": "Azure Kinect",
        "realsense-d435": "RealSense D435",
    }
)
"""Titles of ``pipeline.planning.sensors.sensor_names``."""
WHERES: Mapping[str, str] = MappingProxyType(
    {"walls": "On walls", "ceiling": "On the ceiling", "furniture": "On furniture", "tripods": "On tripods"}
)
"""Titles of ``pipeline.planning.places.WHERES``, whose libraries the server process does not load."""
MATERIALS: Mapping[str, str] = MappingProxyType(
    {"plaster": "Plaster", "wood": "Wood", "brick": "Brick", "concrete": "Concrete"}
)
"""Titles of the walls in ``pipeline.planning.walls.DAMPING_DB``."""
RENDERED = ("as-present", "kinect-v1")
"""Sensors that the demo rooms can be rendered with: the model of their sensor is that of a Kinect v1."""

TEXT = Markdown(
    """Where would the next cameras stand best? The planner judges up to 500 free places by what a camera
there would newly measure; pink ghosts show the best. Walls found in the surface damp the radio."""
)
NONE_YET = Markdown("No plan yet.")
PLANNING = Markdown("Planning; the bar at the top shows the progress. *Cancel* stops it.")
JUDGING = Markdown("The ghost is being judged where it stands now.")
STOPPED = Markdown("The planning was stopped or replaced; press *Suggest* again.")
MISSED = Markdown(
    "**Pink: {:.1f} % of the present cameras' rays meet no measured surface.** They meet a guess or nothing."
)
DRAG = Markdown(
    """**Drag a ghost by its arrows and rings**, or change the numbers below: promise and pink points
follow; brown points look dark to a present sensor. When you let go, its picture and the time of its image
follow, too."""
)
PICTURE = Markdown(
    "What it would see, on the surface known today. Green: newly measured, the stronger the likelier; "
    "violet: guessed surface; red: no surface known."
)
BEFORE = Markdown(
    "**Picture and bars are still those of the place before**; they follow when you let go of the ghost."
)
TAKING = Markdown(
    "The room is rendered from there and reconstructed again; this takes half a minute or more."
)
NO_TRUTH = Markdown("*Take it* renders demo rooms, whose truth is known; this scene is not one of them.")
OTHER_SENSOR = Markdown(
    "*Take it* is not offered for this sensor: the demo rooms know only how a Kinect v1 measures depth, so "
    "the gain of another sensor would be a wrong number. Choose *Kinect v1*, or *As the present ones*."
)
NOT_TAKEN = Markdown("The camera was not added: the computation was stopped or failed.")
