"""The jobs that prepare a recording's walk for the Fuse screen: the walk, and its pictures."""

from __future__ import annotations

from collections.abc import Generator, Sequence

import cv2
import numpy as np

from app.compute.records import SCREEN_POINTS
from app.compute.state import Spec
from app.compute.store import Store
from app.screens.fuse.walk_view import MOTIONS, LoopView, Pictures, WalkView
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.folders.walk import lost_spans, path_m
from pipeline.kernels.geometry import inverse, rotation_angle_rad
from pipeline.recording.recording import Recording
from pipeline.registration.photometric import open_motions
from pipeline.sources import Recorded
from pipeline.spec import key
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray, IntArray, Link, Walk

MOST_PICTURES = 240
"""Most pictures besides those of the keyframes; this number takes about 1 MB."""
PICTURE_PX, QUALITY = 160, 75
"""Width of a picture, and its JPEG quality."""
REPORTED = 10
"""Number of pictures between two reports of progress."""


def walk_job(store: Store, spec: Spec) -> Generator[Progress, None, WalkView]:
    """Return the walk of the spec's recording, without pictures.

    Raises:
        InputError: the source is no recording, or it cannot be read.
    """
    rig = yield from store.stage(spec, "rig")
    yield Progress("preparing the walk", 0.0)
    recording = yield from _opened(spec)
    return view_of(rig.walk, rig.frames[0].intrinsics, recording.view(0).T_color_depth)


def pictures_job(store: Store, spec: Spec, keyframes: tuple[int, ...]) -> Generator[Progress, None, Pictures]:
    """Return small pictures of the keyframes of the spec's recording, and of its other frames.

    Raises:
        InputError: the source is no recording, or it cannot be read.
    """
    recording = yield from _opened(spec)
    remembered = ("walk's pictures", key(spec, "rig"))
    return (yield from store.remember(remembered, lambda: pictures_of(recording, keyframes)))


def _opened(spec: Spec) -> Generator[Progress, None, Recording]:
    if not isinstance(spec.source, Recorded):
        raise InputError(
            f"{spec.source.title} is no recording and has no walk to show; choose a recording under Scene"
        )
    return (yield from spec.source.iterate_open())


def view_of(walk: Walk, camera: CameraIntrinsics, T_color_depth: FloatArray) -> WalkView:
    """Return a walk without pictures.

    Args:
        walk: the recording after tracking.
        camera: its colour camera.
        T_color_depth: (4, 4) pose of the depth camera in the colour camera.
    """
    poses, tracked = _stacked(walk.T_world_camera), _stacked(walk.T_world_tracked)
    loops = [_loop(link, poses, tracked, T_color_depth) for link in walk.links if link.loop]
    rows = _thinned(walk.first_frames)
    return WalkView(
        times_s=walk.times_s - walk.times_s[0],
        T_world_camera=poses,
        T_world_tracked=tracked,
        keyframes=walk.keyframes,
        loops=tuple(sorted(loops, key=lambda loop: (not loop.used, -loop.moved_m))),
        lost=tuple(lost_spans(walk.T_world_camera)),
        path_m=path_m(walk.T_world_camera),
        points_m=walk.map.points_m[rows].astype(np.float32),
        colors=_colors(walk)[rows],
        until=np.searchsorted(walk.first_frames[rows], np.arange(len(poses)), side="right"),
        spacing_m=walk.voxel_m * float(np.sqrt(len(walk.map) / max(len(rows), 1))),
        map_points=len(walk.map),
        fov_rad=2.0 * float(np.arctan2(camera.height_px / 2, camera.fy_px)),
        aspect=camera.width_px / camera.height_px,
    )


def _stacked(T_world_camera: Sequence[FloatArray | None]) -> FloatArray:
    return np.array([np.full((4, 4), np.nan) if T is None else T for T in T_world_camera])


def _colors(walk: Walk) -> ByteArray:
    grey = np.full((len(walk.map), 3), 128, np.uint8)
    return grey if walk.map.colors is None else walk.map.colors


def _thinned(first_frames: IntArray) -> IntArray:
    """Return indices of at most ``SCREEN_POINTS`` points, ordered by the frame that measured each first."""
    rows = np.argsort(first_frames, kind="stable")
    if len(rows) > SCREEN_POINTS:
        kept = np.random.default_rng(0).choice(len(rows), SCREEN_POINTS, replace=False)
        rows = rows[np.sort(kept)]
    return rows


def _loop(link: Link, poses: FloatArray, tracked: FloatArray, T_color_depth: FloatArray) -> LoopView:
    """Return a loop of the colour camera with its differences from tracking alone and the final poses."""
    T = T_color_depth @ link.T_target_source @ inverse(T_color_depth)
    moved_m, turned_rad = _apart(T, inverse(tracked[link.target]) @ tracked[link.source])
    left_m, left_rad = _apart(T, inverse(poses[link.target]) @ poses[link.source])
    return LoopView(
        source=link.source,
        target=link.target,
        moved_m=moved_m,
        turned_rad=turned_rad,
        left_m=left_m,
        left_rad=left_rad,
        overlap_share=link.overlap_share,
        agreeing_share=link.agreeing_share,
        held=MOTIONS - open_motions(link.information).shape[1],
        used=link.used,
    )


def _apart(one: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Return the distance between two (4, 4) poses, metres, and the angle between them, radians."""
    away_m = float(np.linalg.norm(one[:3, 3] - other[:3, 3]))
    return away_m, float(rotation_angle_rad(other[:3, :3].T @ one[:3, :3]))


def pictures_of(recording: Recording, keyframes: Sequence[int]) -> Generator[Progress, None, Pictures]:
    """Return small pictures of the keyframes, and of every n-th frame so that these are at most
    ``MOST_PICTURES``.

    Frames whose images cannot be read have none.
    """
    frames = len(recording.times_s)
    every = -(-frames // MOST_PICTURES)
    numbers, pictures = [], []
    for count, frame in enumerate(sorted({*range(0, frames, every), *keyframes})):
        if count % REPORTED == 0:
            yield Progress(f"reading picture {frame} of {frames}", frame / frames)
        try:
            picture = jpeg_of(recording.frame(frame).rgb)
        except InputError:
            continue
        numbers.append(frame)
        pictures.append(picture)
    return Pictures(np.array(numbers, int), tuple(pictures))


def jpeg_of(rgb: ByteArray) -> bytes:
    """Return a JPEG file, ``PICTURE_PX`` wide, of an (H, W, 3) image."""
    height, width = rgb.shape[:2]
    size = PICTURE_PX, max(1, round(PICTURE_PX * height / width))
    small = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    encoded = cv2.imencode(".jpg", small[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, QUALITY))[1]
    return bytes(encoded.tobytes())
