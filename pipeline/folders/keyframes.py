"""Keyframes of a recording for other programs: images with nerfstudio's and COLMAP's files.

https://docs.nerf.studio/quickstart/data_conventions.html; https://colmap.github.io/format.html.
"""

from __future__ import annotations

import shutil
from collections.abc import Generator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, file_trouble, write_json
from packetmesh.progress import Progress
from pipeline.importing.arkit import Y_DOWN
from pipeline.importing.colmap_model import CENTRE_PX
from pipeline.importing.rig_folder import new_folder
from pipeline.io.images import write_color, write_depth_mm
from pipeline.kernels.geometry import inverse, is_pinhole
from pipeline.kernels.straight_view import straight_depth, straight_image, straight_view
from pipeline.recording.photographs import measured_in
from pipeline.recording.recording import Recording
from pipeline.types import CameraIntrinsics, FloatArray, IntArray, PointCloud, RgbdFrame, Walk

FOLDER = "keyframes"
MOST_POINTS = 20_000
"""Largest number of the map's points that the COLMAP model has, spread evenly."""


@dataclass(frozen=True, slots=True)
class _Written:
    """A keyframe whose images were written."""

    color: str
    """Name of the file in images/."""
    depth: str
    """Name of the file in depth/."""
    camera: CameraIntrinsics
    T_world_camera: FloatArray
    points: IntArray
    """(N,) indices, in the COLMAP model, of the points that it sees."""
    pixels: FloatArray
    """(N, 2) columns and rows of these points."""


def delete_keyframes(folder: Path) -> None:
    """Delete the keyframes of an earlier run, complete or interrupted, from its folder.

    Raises:
        InputError: they cannot be deleted.
    """
    try:
        for path in (*folder.glob(FOLDER), *folder.glob(f".{FOLDER}-*")):
            shutil.rmtree(path)
    except OSError as error:
        raise InputError(file_trouble(error)) from None


def iterate_keyframes(recording: Recording, walk: Walk, folder: Path) -> Generator[Progress, None, Path]:
    """Write ``folder``/keyframes with images/, depth/, transforms.json, and sparse/ as COLMAP's text model.

    The folder is written completely or not at all, and replaces that of an earlier run. Images have no
    distortion; depth is in whole millimetres, on the pixels of its colour image. Keyframes without a pose or
    that cannot be read are left out.

    Args:
        recording: the frames.
        walk: the recording after tracking.
        folder: folder of the run.

    Raises:
        InputError: no keyframe has a pose and can be read, or the folder cannot be written.
    """
    out = folder / FOLDER
    delete_keyframes(folder)
    cloud = walk.map.select(np.arange(0, len(walk.map), max(1, -(-len(walk.map) // MOST_POINTS))))
    with new_folder(out) as unfinished:
        written = yield from _iterate_images(recording, walk, unfinished, cloud)
        write_json(unfinished / "transforms.json", _transforms(written))
        _write_model(unfinished / "sparse", written, cloud)
    return out


def _iterate_images(
    recording: Recording, walk: Walk, out: Path, cloud: PointCloud
) -> Generator[Progress, None, list[_Written]]:
    """Write the images of the keyframes that have a pose and can be read.

    Raises:
        InputError: there are none.
    """
    written: list[_Written] = []
    unreadable = ""
    for done, number in enumerate(walk.keyframes):
        yield Progress(f"writing keyframe {done} of {len(walk.keyframes)}", done / len(walk.keyframes))
        T = walk.T_world_camera[number]
        if T is None:
            continue
        try:
            frame = straight(replace(recording.frame(number), T_world_camera=T))
        except InputError as error:
            unreadable = str(error)
            continue
        written.append(_write(out, frame, cloud))
    if not written:
        raise InputError(unreadable or f"No keyframe of {recording.name} has a pose; try a longer recording")
    return written


def straight(frame: RgbdFrame) -> RgbdFrame:
    """Return a frame without distortion, in the pinhole camera of its ``straight_view``."""
    camera = frame.intrinsics
    if is_pinhole(camera):
        return frame
    view = straight_view(camera)
    rgb, depth = straight_image(frame.rgb, camera, view), straight_depth(frame.depth, camera, view)
    return replace(frame, rgb=rgb, depth=depth, intrinsics=view)


def _write(out: Path, frame: RgbdFrame, cloud: PointCloud) -> _Written:
    """Write the images of a keyframe, and find which points it sees."""
    color, depth = f"{frame.name}.jpg", f"{frame.name}.png"
    write_color(out / "images" / color, frame.rgb)
    write_depth_mm(out / "depth" / depth, frame.depth)
    rows, pixels, _ = measured_in(frame, cloud.points_m)
    return _Written(color, depth, frame.intrinsics, frame.T_world_camera, rows, pixels)


def _transforms(written: list[_Written]) -> dict[str, object]:
    """Return the values of transforms.json: OpenGL's camera axes; the first pixel's corner is 0, 0."""
    frames = [
        {
            "file_path": f"images/{own.color}",
            "depth_file_path": f"depth/{own.depth}",
            "transform_matrix": own.T_world_camera @ Y_DOWN,
        }
        | _lens(own.camera)
        for own in written
    ]
    return {"camera_model": "PINHOLE"} | _lens(written[0].camera) | {"frames": frames}


def _lens(camera: CameraIntrinsics) -> dict[str, float]:
    return {
        "fl_x": camera.fx_px,
        "fl_y": camera.fy_px,
        "cx": camera.cx_px + CENTRE_PX,
        "cy": camera.cy_px + CENTRE_PX,
        "w": camera.width_px,
        "h": camera.height_px,
    }


def _write_model(folder: Path, written: list[_Written], cloud: PointCloud) -> None:
    """Write cameras.txt, images.txt and points3D.txt; the unit is the metre."""
    cameras = ["# CAMERA_ID MODEL WIDTH HEIGHT FX FY CX CY"]
    images = ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then X Y POINT3D_ID of each point"]
    tracks: list[list[str]] = [[] for _ in range(len(cloud))]
    for number, own in enumerate(written, start=1):
        numbers = " ".join(f"{value:.9g}" for value in list(_lens(own.camera).values())[:4])
        cameras.append(f"{number} PINHOLE {own.camera.width_px} {own.camera.height_px} {numbers}")
        T = inverse(own.T_world_camera)
        x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
        pose = " ".join(f"{value:.12g}" for value in (w, x, y, z, *T[:3, 3]))
        seen = zip(own.pixels + CENTRE_PX, own.points, strict=True)
        images.append(f"{number} {pose} {number} {own.color}")
        images.append(" ".join(f"{u:.2f} {v:.2f} {point + 1}" for (u, v), point in seen))
        for place, point in enumerate(own.points):
            tracks[point].append(f"{number} {place}")
    points = ["# POINT3D_ID X Y Z R G B ERROR TRACK[]"]
    colors = np.full((len(cloud), 3), 128) if cloud.colors is None else cloud.colors
    for point, ((x, y, z), (r, g, b), track) in enumerate(
        zip(cloud.points_m, colors, tracks, strict=True), start=1
    ):
        points.append(f"{point} {x:.6f} {y:.6f} {z:.6f} {r} {g} {b} 0 {' '.join(track)}".rstrip())
    for name, lines in (("cameras", cameras), ("images", images), ("points3D", points)):
        with atomic_path(folder / f"{name}.txt") as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
