"""Drawing of a walk: the map is sent once, in pieces; then only visibility, poses and one picture change."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np
import viser

from app.compute.records import Sample
from app.drawing.cameras import axes_downwards, distances_m, turn
from app.drawing.clouds import add_cloud
from app.drawing.colors import DELIVERED, LOSS, SOURCE
from app.drawing.poses import move, place
from app.screens.fuse.walk_view import NO_PICTURES, LoopView, WalkView
from pipeline.types import ByteArray, FloatArray, IntArray

PIECES = 80
"""Approximate number of clouds into which the map is split."""
COLORS = {
    "solid": SOURCE,
    "faint": (246, 214, 150),
    "dashed": (30, 34, 40),
    "gaps": (255, 255, 255),
    "frustum": SOURCE,
    "loop": DELIVERED,
}
"""Colours by the names in ``walk_numbers.LINES``; gaps are white, to be seen on any map."""
WIDTHS_PX = {"solid": 4.0, "faint": 3.0, "dashed": 3.5, "gaps": 3.5}
POINT = 0.75
"""Size of a point over the distance between neighbours."""
FRUSTUM = 0.35
"""Size of a frustum over the distance from the middle of the path to the nearest tenth of the map."""
MOST_FRUSTUM_M = 0.3
"""Largest size of a frustum."""
FITTED, MARGIN = 3000, 0.9
"""Most map points that are fitted into the picture, and the share of the picture that they may fill."""
MOST_SEGMENTS = 1000
"""A path is drawn in at most this number of segments, and one more for each part between lost frames."""
DASHES = 30
"""Number of dashes of the path by tracking alone."""
NAME = 2.2
"""Distance of a name from the middle of its picture, over the picture's height."""
ENLARGED = (1, 2, 5, 10, 20, 50)
"""Factors by which the drift may be enlarged."""
SEEN_DRIFT = 0.2
"""Largest drift in the drawing over the path's extent."""


def enlarging(view: WalkView) -> int:
    """Return the factor by which the drift is enlarged in the drawing.

    This is the largest of ``ENLARGED`` at which the drawn drift is at most ``SEEN_DRIFT`` times the path's
    extent; 1 if none is.
    """
    drift_m = float(np.nanmax(view.drift_m))
    most_m = SEEN_DRIFT * float(np.linalg.norm(np.nanmax(view.at_m, axis=0) - np.nanmin(view.at_m, axis=0)))
    return max((times for times in ENLARGED if times * drift_m <= most_m), default=1)


def shifted(view: WalkView, times: int) -> FloatArray:
    """Return (F, 3) positions by tracking alone, their drift enlarged this many times."""
    shifted_m: FloatArray = view.at_m + times * (view.tracked_m - view.at_m)
    return shifted_m


class WalkDrawing:
    """Drawing of a walk below a scene node; it can show any moment."""

    def __init__(self, scene: viser.SceneApi, below: str, view: WalkView) -> None:
        """Draw the paths and, hidden, the pieces of the map and the cameras."""
        self._scene, self._below, self._view = scene, below, view
        self.pictures = NO_PICTURES
        self._size_m = frustum_m(view)
        self.ends = pieces(view.until)
        starts = np.append(0, self.ends[:-1])
        self._pieces = [
            self._add_points(f"map{index}", start, end)
            for index, (start, end) in enumerate(zip(starts, self.ends, strict=True))
        ]
        self._whole = 0
        self._faint, self._solid = self._add_line("faint"), self._add_line("solid")
        self._dashed, self._gaps = self._add_line("dashed"), self._add_line("gaps")
        self._camera = self._add_camera("camera", SOURCE)
        self._alone = self._add_camera("alone", COLORS["dashed"])
        self._pair = [self._add_camera(f"loop{index}", DELIVERED) for index in range(2)]
        self._names = [self._add_name(index) for index in range(2)]
        self.enlarge(1)

    def _add_points(self, name: str, start: int, end: int) -> viser.PointCloudHandle:
        view = self._view
        sample = Sample(view.points_m[start:end], view.colors[start:end], end - start)
        name = f"{self._below}/{name}"
        size_m = POINT * view.spacing_m
        return add_cloud(self._scene, name, sample, np.eye(4), size_m=size_m, visible=False)

    def _add_line(self, look: str) -> viser.LineSegmentsHandle:
        return self._scene.add_line_segments(
            f"{self._below}/{look}",
            np.zeros((1, 2, 3), np.float32),
            np.array(COLORS[look]),
            thickness=WIDTHS_PX[look],
            thickness_units="screen",
            visible=False,
        )

    def _add_camera(self, name: str, color: tuple[int, int, int]) -> viser.CameraFrustumHandle:
        return self._scene.add_camera_frustum(
            f"{self._below}/{name}",
            fov=self._view.fov_rad,
            aspect=self._view.aspect,
            scale=self._size_m,
            thickness=0.04 * self._size_m,
            color=color,
            format="jpeg",
            visible=False,
        )

    def _add_name(self, index: int) -> viser.LabelHandle:
        """Add the name of a loop's first camera above its picture, or of its second one below."""
        _, height, depth = self._pair[index].compute_canonical_frustum_size()
        return self._scene.add_label(
            f"{self._below}/loop{index}/name",
            "",
            font_screen_scale=0.9,
            anchor="top-center" if index else "bottom-center",
            position=(0.0, NAME * (2 * index - 1) * height * self._size_m, depth * self._size_m),
        )

    def enlarge(self, times: int) -> None:
        """Draw the path by tracking alone with its distance from the final path multiplied by ``times``."""
        self._times = times
        dashes, gaps = _dashes(self._shifted())
        self._show_line(self._dashed, dashes)
        self._show_line(self._gaps, gaps)

    def _shifted(self) -> FloatArray:
        return shifted(self._view, self._times)

    def show(self, frame: int) -> None:
        """Show the moment of a frame: the map, the path and the camera with its picture."""
        view = self._view
        whole = int(np.searchsorted(self.ends, view.until[frame], side="right"))
        for index in range(min(whole, self._whole), max(whole, self._whole)):
            self._pieces[index].visible = index < whole
        self._whole = whole
        self._show_line(self._solid, segments(view.at_m[: frame + 1]))
        self._show_line(self._faint, segments(view.at_m[frame:]))
        T = view.T_world_camera[frame]
        known = bool(np.isfinite(T).all())
        self._camera.visible = known
        self._alone.visible = known and self._times * view.drift_m[frame] > 0.05 * self._size_m
        if known:
            self._put(self._camera, T, self.pictures.of(frame))
        if self._alone.visible:
            alone = view.T_world_tracked[frame].copy()
            alone[:3, 3] = self._shifted()[frame]
            move(self._alone, alone)

    def _show_line(self, line: viser.LineSegmentsHandle, segments_m: FloatArray) -> None:
        line.visible = bool(len(segments_m))
        if len(segments_m):
            line.points = segments_m

    def choose(self, loop: LoopView | None) -> None:
        """Show the cameras of a loop's two keyframes with their pictures; None hides them."""
        frames = () if loop is None else loop.frames
        for camera in self._pair:
            camera.visible = bool(frames)
        for camera, name, frame in zip(self._pair, self._names, frames, strict=False):
            camera.color = DELIVERED if loop is not None and loop.used else LOSS
            name.text = f"frame {frame}"
            self._put(camera, self._view.T_world_camera[frame], self.pictures.of(frame))

    def _put(self, camera: viser.CameraFrustumHandle, T: FloatArray, picture: bytes | None) -> None:
        place(camera, T)
        if picture is not None:
            camera.image = _rgb(picture)

    def look(self, clients: Iterable[viser.ClientHandle]) -> None:
        """Turn the browsers' views to the map and the paths, from behind and above."""
        for client in clients:
            turn(client, *viewpoint(self._view, client.camera.fov, client.camera.aspect))


def pieces(until: IntArray) -> IntArray:
    """Return (P,) ascending end indices of the map's pieces: each has the new points of a few frames.

    Args:
        until: (F,) number of points after each frame.
    """
    least = max(1, int(until[-1]) // PIECES)
    ends = [0]
    for end in until.tolist():
        if end - ends[-1] >= least or (end == until[-1] and end > ends[-1]):
            ends.append(end)
    return np.array(ends[1:], int)


def frustum_m(view: WalkView) -> float:
    """Return the size of a frustum, metres, at which it hides little of what the camera sees."""
    nearest_m = np.nanpercentile(np.linalg.norm(view.points_m - np.nanmean(view.at_m, axis=0), axis=1), 10)
    return min(FRUSTUM * float(nearest_m), MOST_FRUSTUM_M)


def viewpoint(view: WalkView, fov_rad: float, aspect: float) -> tuple[FloatArray, FloatArray]:
    """Return (3,) the point to look at and (3,) the place to look from, behind the camera and above it.

    The map and both paths fit into a picture with this vertical field of view and this width over height.
    """
    gaze = np.nanmean(view.T_world_camera[:, :3, 2], axis=0)
    axes = axes_downwards(gaze)
    seen_m = view.points_m[:: 1 + len(view.points_m) // FITTED] @ axes.T
    paths_m = np.concatenate([view.at_m, shifted(view, enlarging(view))]) @ axes.T
    paths_m = paths_m[np.isfinite(paths_m).all(axis=1)]
    seen_m = np.concatenate([np.clip(seen_m, *np.percentile(seen_m, [1, 99], axis=0)), paths_m])
    middle_m = 0.5 * (seen_m.min(axis=0) + seen_m.max(axis=0))
    half = np.tan(0.5 * fov_rad) * MARGIN
    back_m = distances_m(seen_m - middle_m, half * aspect, half)
    center_m = middle_m @ axes
    return center_m, center_m - float(back_m.max()) * axes[2]


def segments(at_m: FloatArray) -> FloatArray:
    """Return (S, 2, 3) segments between successive (F, 3) positions; none at NaN.

    Many positions are thinned; the first and the last one before and after NaN stay.
    """
    known = np.isfinite(at_m).all(axis=1)
    around = np.pad(known, 1)
    ends = ~(around[:-2] & around[2:])
    regular = np.arange(len(at_m)) % max(1, -(-len(at_m) // MOST_SEGMENTS)) == 0
    kept = np.flatnonzero(known & (ends | regular))
    part = np.cumsum(~known)[kept]
    joined = part[1:] == part[:-1]
    found: FloatArray = np.stack([at_m[kept[:-1]], at_m[kept[1:]]], axis=1)[joined].astype(np.float32)
    return found


def _dashes(at_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the dashes and the gaps of a line through (F, 3) positions, each as (S, 2, 3) segments."""
    lines_m = segments(at_m)
    length_m = np.linalg.norm(lines_m[:, 1] - lines_m[:, 0], axis=1).cumsum()
    dash = (2 * DASHES * length_m / max(float(length_m.max(initial=0.0)), 1e-9)).astype(int)
    return lines_m[dash % 2 == 0], lines_m[dash % 2 == 1]


def _rgb(jpeg: bytes) -> ByteArray:
    """Return the (H, W, 3) image of a JPEG file."""
    bgr: Any = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    rgb: ByteArray = bgr[..., ::-1]
    return rgb
