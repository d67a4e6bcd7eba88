"""Depth images of a bag: their scale, and the camera that took them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.bag_cameras import sdk_stream
from pipeline.importing.bag_messages import depth_values_of
from pipeline.importing.bag_reader import BagReader
from pipeline.importing.bag_topics import Topic
from pipeline.importing.bag_transforms import Transforms, sdk_units_per_metre
from pipeline.importing.depth_units import depth_of
from pipeline.importing.depth_views import DepthCamera
from pipeline.io.depth_scale import known_in, usual_scale
from pipeline.io.images import NoDepthError, ReadDepth
from pipeline.io.same_view import alike, depth_camera_of, same_view_note


@dataclass(frozen=True, slots=True)
class BagScale:
    """Scale of a topic's depth images."""

    topic: str
    units_per_metre: float | None
    """Depth units per metre; None takes those of the images' encoding."""

    @classmethod
    def of(cls, reader: BagReader, topic: str, given: float | None) -> BagScale:
        """Return the scale that the user gave, or else the one that the RealSense SDK recorded, if any."""
        return cls(topic, given or sdk_units_per_metre(reader, topic))

    def read(self, message: Any) -> ReadDepth:
        """Return the depth of an Image or CompressedImage.

        Raises:
            InputError: it is damaged, or beyond 65 m everywhere; NoDepthError if no depth is known.
        """
        values = depth_values_of(message, self.topic)
        if not known_in(values).any():
            raise NoDepthError(f"A depth image of {self.topic} has no depth anywhere; try another recording")
        scale = self.units_per_metre or usual_scale(values)
        return depth_of(f"of {self.topic}", values, scale, self.units_per_metre is not None)


def place_of_depth(
    color: Topic, depth: Topic, shape: tuple[int, ...], transforms: Transforms
) -> tuple[DepthCamera | None, tuple[str, ...]]:
    """Return the depth camera, None if depth is on the colour image's pixels, and notes.

    Args:
        color: the colour topic.
        depth: the depth topic.
        shape: height and width of the depth images.
        transforms: transforms of the bag.

    Raises:
        InputError: the depth camera or its place is unknown, or depth is not in proportion to colour.
    """
    if sdk_stream(depth.name):
        T_color_depth, notes = transforms.between_streams(color.name, depth.name)
        if depth.found.camera is None:
            raise InputError(f"{depth.name} has no camera that can be used: {depth.found.why_not}")
        registered = alike(depth.camera, color.camera) and np.allclose(T_color_depth, np.eye(4), atol=1e-6)
        notes = (*depth.found.notes, *notes)
        return None if registered else DepthCamera(depth.camera, T_color_depth), notes
    if depth.frame == color.frame:
        return _in_one_frame(color, depth, shape)
    T = transforms.between(color.frame, depth.frame)
    missing = [] if depth.found.camera else ["its camera_info"]
    missing += [] if T is not None else [f"a static transform between {color.frame} and {depth.frame}"]
    if missing or T is None:
        raise InputError(
            f"{depth.name} is in the frame {depth.frame}, not registered to {color.name} in {color.frame}, "
            f"and the bag lacks {' and '.join(missing)}; try to record that, too"
        )
    return DepthCamera(depth.camera, T), depth.found.notes


def _in_one_frame(
    color: Topic, depth: Topic, shape: tuple[int, ...]
) -> tuple[DepthCamera | None, tuple[str, ...]]:
    """Return the camera of depth in the colour images' frame, and notes.

    It is that of its own camera_info, or the colour camera, resized; None if depth is on the
    colour image's pixels.
    """
    own = depth.found.camera if depth.found.by_name else None
    if own is not None and not alike(own, color.camera):
        note = (
            f"its camera_info is not that of {color.name}, so that it is registered to it from the same place"
        )
        return DepthCamera(own, np.eye(4)), (*depth.found.notes, note)
    remedy = f"try to record the camera_info of {depth.name}, too"
    resized = depth_camera_of(color.camera, shape, f"of {depth.name}", f"of {color.name}", remedy)
    if resized is None:
        return None, ()
    return DepthCamera(resized, np.eye(4)), (same_view_note(color.camera, resized),)
