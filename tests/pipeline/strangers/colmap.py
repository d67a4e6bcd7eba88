"""The room as COLMAP's text model (https://colmap.github.io/format.html), without COLMAP's own package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pycolmap

from pipeline.types import FloatArray, RgbdFrame, Rig
from tests.pipeline.strangers.images import quaternion, save_color, save_depth

METRES_A_UNIT = 0.37
"""Length of the unit of a model that knows no metres."""


def write_colmap_dense(folder: Path, rig: Rig) -> Path:
    """Depth maps of patch_match_stereo in a model whose unit is the metre."""
    for index, frame in enumerate(rig.frames):
        file = folder / "stereo" / "depth_maps" / f"{index}.png.geometric.bin"
        file.parent.mkdir(parents=True, exist_ok=True)
        values = np.nan_to_num(frame.depth.z_m).astype("<f4")
        file.write_bytes(b"%d&%d&1&" % values.shape[::-1] + values.tobytes())
    _write_model(folder, rig, 1.0, [[] for _ in rig.frames], [])
    return folder


def write_colmap_sensor(folder: Path, rig: Rig) -> Path:
    """A model of its own unit, next to a sensor's depth images; its points are seen in one image each."""
    points: list[str] = []
    features: list[list[str]] = []
    for index, frame in enumerate(rig.frames):
        save_depth(folder / "depth" / f"{index}.png", frame)
        features.append([])
        for v, u in np.argwhere(frame.depth.valid)[:: 20 * (1 + index)]:
            place = _world_m(frame, u, v) / METRES_A_UNIT
            track = f"{index + 1} {len(features[-1])}"
            points.append(f"{len(points) + 1} {' '.join(f'{x:.6f}' for x in place)} 9 9 9 0.4 {track}")
            features[-1].append(f"{u + 0.5} {v + 0.5} {len(points)}")
    _write_model(folder, rig, METRES_A_UNIT, features, points)
    return folder


def _world_m(frame: RgbdFrame, u: int, v: int) -> FloatArray:
    ray = np.linalg.solve(frame.intrinsics.matrix, [u, v, 1.0])
    return (frame.T_world_camera @ [*(frame.depth.z_m[v, u] * ray), 1.0])[:3]


def _write_model(
    folder: Path, rig: Rig, metres_a_unit: float, features: list[list[str]], points: list[str]
) -> None:
    """Write images and model; a pixel's centre has the coordinate 0.5."""
    images = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "# POINTS2D[]"]
    for index, frame in enumerate(rig.frames):
        save_color(folder / "images" / f"{index}.png", frame.rgb)
        T_camera_world = np.linalg.inv(frame.T_world_camera)
        x, y, z, w = quaternion(T_camera_world)
        numbers = w, x, y, z, *(T_camera_world[:3, 3] / metres_a_unit)
        images += [f"{index + 1} {' '.join(map(repr, map(float, numbers)))} 1 {index}.png"]
        images += [" ".join(features[index])]
    K = rig.frames[0].intrinsics
    camera = f"1 PINHOLE {K.width_px} {K.height_px} {K.fx_px} {K.fy_px} {K.cx_px + 0.5} {K.cy_px + 0.5}"
    (folder / "sparse").mkdir()
    for name, lines in (("cameras", [camera]), ("images", images), ("points3D", points)):
        (folder / "sparse" / f"{name}.txt").write_text("\n".join([f"# {name}", *lines]) + "\n")


def write_colmap_binary(folder: Path, rig: Rig) -> Path:
    """A model of its own unit, made binary by pycolmap, with its rigs.bin and frames.bin."""
    write_colmap_sensor(folder, rig)
    model = pycolmap.Reconstruction(str(folder / "sparse"))
    for file in (folder / "sparse").iterdir():
        file.unlink()
    model.write_binary(str(folder / "sparse"))
    return folder
