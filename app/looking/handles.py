"""Arrows and rings in the picture that move a cut, with the cut's outline."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import viser

from app.compute.cuts import Box, Cut, Place, Plane, Top, box_axes
from app.drawing.colors import BRAND
from app.drawing.poses import wxyz_of
from app.looking.room import Room
from pipeline.kernels.geometry import rigid
from pipeline.types import FloatArray

ARROWS = 0.16
"""Size of a plane's handle over the diagonal of the room; the handles of other cuts are half as large."""
SHEET = 0.25
"""Half the width of a plane's outline over the diagonal of the room."""
LEAST_M = 0.01
"""Least length of a box's edge."""
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_EDGES = [(a, b) for a in range(8) for b in range(a) if np.sum(_CORNERS[a] != _CORNERS[b]) == 1]
_SQUARE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])


class CutHandles:
    """The handles that move a cut, as children of a scene node; the page's script reads their poses."""

    def __init__(
        self,
        scene: viser.SceneApi,
        below: str,
        post: Callable[..., None],
        on_drag: Callable[[Cut, bool], object],
    ) -> None:
        """Draw nothing yet.

        Args:
            scene: the scene.
            below: name of the node that gets the handles.
            post: runs a function on the session's thread, on which all methods run.
            on_drag: called with the dragged cut and whether the drag has ended.
        """
        self._scene, self._below, self._post, self._on_drag = scene, below, post, on_drag
        self._cut: Cut = None
        self._frame: viser.FrameHandle | None = None
        self._grips: list[viser.TransformControlsHandle] = []
        self._outline: viser.LineSegmentsHandle | None = None

    @property
    def planes(self) -> list[tuple[str, list[float]]]:
        """Name of the handle and normal in its frame, for each plane of ``planes_of`` in the same order."""
        if isinstance(self._cut, Box):
            normals = [[-_side(row) * (axis == row // 2) for axis in range(3)] for row in range(6)]
        else:
            normals = [[0.0, 0.0, -1.0 if isinstance(self._cut, Top) else 1.0]]
        return [(grip.name, normal) for grip, normal in zip(self._grips, normals, strict=False)]

    def draw(self, cut: Cut, room: Room | None) -> None:
        """Draw or move the handles so that they fit the cut; remove them if the cut or the room is None."""
        cut = None if room is None else cut
        if type(cut) is not type(self._cut) or not self._alive:
            self._remove()
            if cut is not None and room is not None:
                self._add(cut, float(np.linalg.norm(room.size_m)))
        self._cut = cut
        if isinstance(cut, Box):
            self._arrange(cut)
        elif isinstance(cut, Plane):
            self._grips[0].position = np.array(cut.point_m)
            self._grips[0].wxyz = wxyz_of(rigid(facing(np.array(cut.normal)), np.zeros(3)))
        elif cut is not None and room is not None:
            self._grips[0].position = np.array([*room.centre_m[:2], cut.height_m])

    @property
    def _alive(self) -> bool:
        """Whether the drawing is there: the screen may have cleared everything below its node."""
        frame = self._frame
        return frame is not None and self._scene.get_handle_by_name(frame.name) is frame

    def _remove(self) -> None:
        if self._frame is not None and self._alive:
            self._frame.remove()
        self._frame, self._grips, self._outline = None, [], None

    def _add(self, cut: Top | Plane | Box, diagonal_m: float) -> None:
        scene, turns = self._scene, isinstance(cut, Plane)
        self._frame = scene.add_frame(self._below, show_axes=False)
        for row in range(6 if isinstance(cut, Box) else 1):
            along = row // 2 if isinstance(cut, Box) else 2
            grip = scene.add_transform_controls(
                f"{self._below}/{row}",
                scale=ARROWS * diagonal_m * (1.0 if turns else 0.5),
                active_axes=(turns or along == 0, turns or along == 1, turns or along == 2),
                disable_sliders=True,
                disable_rotations=not turns,
                depth_test=False,
            )
            grip.on_update(partial(self._grabbed, row, grip))
            self._grips.append(grip)
        self._outline = scene.add_line_segments(
            f"{self._below if isinstance(cut, Box) else self._grips[0].name}/outline",
            _closed(SHEET * diagonal_m * _SQUARE).astype(np.float32),
            np.array(BRAND, np.uint8),
            thickness=2.0,
            thickness_units="screen",
        )

    def _arrange(self, box: Box, turned: bool = True) -> None:
        """Move handles and outline to the box. Their common frame moves only if ``turned``, which is False
        while a handle is dragged.
        """
        assert self._frame is not None
        assert self._outline is not None
        axes = box_axes(box)
        if turned:
            self._frame.wxyz = wxyz_of(rigid(axes.T, np.zeros(3)))
            self._frame.position = np.array(box.centre_m)
        middle_m = axes @ (np.array(box.centre_m) - np.asarray(self._frame.position))
        size_m = np.array(box.size_m)
        for row, grip in enumerate(self._grips):
            place_m = middle_m + 0.5 * _side(row) * size_m * (np.arange(3) == row // 2)
            if not np.allclose(grip.position, place_m, atol=1e-6):
                grip.position = place_m
        corners_m = middle_m + _CORNERS * size_m
        self._outline.points = np.array([[corners_m[a], corners_m[b]] for a, b in _EDGES], np.float32)

    def _grabbed(self, row: int, grip: viser.TransformControlsHandle, event: Any) -> None:
        """Note the pose of a dragged handle, on the thread of the browser's messages."""
        pose = np.array(grip.position, float), np.array(grip.wxyz, float)
        self._post(self._dragged, row, grip, *pose, event.phase == "end")

    def _dragged(
        self,
        row: int,
        grip: viser.TransformControlsHandle,
        at_m: FloatArray,
        wxyz: FloatArray,
        ended: bool,
    ) -> None:
        """Report the cut moved to the dragged handle, unless other handles have replaced it meanwhile."""
        if grip in self._grips:
            self._on_drag(self._moved(row, at_m, wxyz), ended)

    def _moved(self, row: int, at_m: FloatArray, wxyz: FloatArray) -> Cut:
        """Return the cut moved to a handle's (3,) position and (4,) quaternion; None if there is no cut."""
        cut = self._cut
        if isinstance(cut, Top):
            return Top(float(at_m[2]))
        if isinstance(cut, Plane):
            return Plane(_place(at_m), _place(turned(wxyz)[:, 2]))
        if isinstance(cut, Box) and self._frame is not None:
            frame_m = box_axes(cut) @ np.asarray(self._frame.position)
            return with_face(cut, row, float((frame_m + at_m)[row // 2]))
        return None

    def follow(self, cut: Cut) -> None:
        """Take the cut that a handle is dragging, and move a box's other handles and outline with it."""
        self._cut = cut
        if isinstance(cut, Box) and self._alive:
            self._arrange(cut, turned=False)


def with_face(box: Box, row: int, at_m: float) -> Box:
    """Return the box with a face moved along its axis. The opposite face stays, at least 1 cm away.

    Args:
        box: the box.
        row: index of the face: twice its axis, plus one for the side of larger coordinates.
        at_m: new coordinate of the face along its axis, from the world's origin.
    """
    axis, axes = row // 2, box_axes(box)
    middle_m = axes @ np.array(box.centre_m)
    other_m = float(middle_m[axis] - 0.5 * _side(row) * box.size_m[axis])
    length_m = max(_side(row) * (at_m - other_m), LEAST_M)
    size_m = np.array(box.size_m)
    size_m[axis] = length_m
    middle_m[axis] = other_m + 0.5 * _side(row) * length_m
    return Box(_place(middle_m @ axes), _place(size_m), box.turn_deg, box.inside)


def facing(normal: FloatArray) -> FloatArray:
    """Return a (3, 3) rotation whose z axis is a (3,) unit normal, with its x axis level."""
    x = np.cross([0.0, 0.0, 1.0], normal)
    if np.linalg.norm(x) < 1e-6:
        x = np.array([1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal], axis=1)


def turned(wxyz: Any) -> FloatArray:
    """Return the (3, 3) rotation of a quaternion, w first."""
    return np.asarray(viser.transforms.SO3(np.asarray(wxyz, float)).as_matrix())


def _side(row: int) -> float:
    """Return 1 for a face on the side of larger coordinates, else -1."""
    return 1.0 if row % 2 else -1.0


def _closed(corners_m: FloatArray) -> FloatArray:
    """Return the (K, 2, 3) edges of a polygon with (K, 3) corners."""
    return np.stack([corners_m, np.roll(corners_m, -1, axis=0)], axis=1)


def _place(values: FloatArray) -> Place:
    x, y, z = values.tolist()
    return (x, y, z)
