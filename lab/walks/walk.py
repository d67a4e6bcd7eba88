"""Rendering of a walk into a folder of TUM form, and reading of its truth."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.places.pairs import FOV_DEG
from lab.walks.path import RATE_HZ, walk_poses
from lab.walks.shutter import photographs
from lab.worlds.film import Film
from lab.worlds.raycast import world_mesh
from lab.worlds.render import Renderer
from lab.worlds.scene import Rng, Scene
from lab.worlds.sensor import sense_depth
from packetmesh.errors import InputError
from packetmesh.files import atomic_path, writable_folder
from pipeline.importing.tum import UNITS_PER_METRE
from pipeline.io.images import write_color
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_tum
from pipeline.types import AnyPath, CameraIntrinsics, DepthMap, FloatArray, IntArray

TRUE_POSES = "groundtruth_true.txt"
"""File of the true poses; under TUM's own name the importer would read them as known poses."""
TRUTH = "truth.npz"
"""File of a ``WalkTruth``."""


@dataclass(frozen=True, slots=True)
class WalkTruth:
    """Ground truth of a walk."""

    vertices_m: FloatArray
    """(V, 3) vertices of the room's surface, world frame."""
    triangles: IntArray
    """(F, 3)."""
    T_world_camera: FloatArray
    """(N, 4, 4) pose of every frame."""


def kinect(width_px: int) -> CameraIntrinsics:
    """Return the pinhole camera of a Kinect's field of view, ``width_px`` wide, 4:3."""
    height_px = width_px * 3 // 4
    focal_px = 0.5 * width_px / np.tan(np.radians(0.5 * FOV_DEG))
    return CameraIntrinsics.pinhole(
        focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1), width_px, height_px
    )


def render_walk(scene: Scene, frames: int, camera: CameraIntrinsics, out: AnyPath, seed: int = 0) -> None:
    """Write a walk through a room frame by frame; the same arguments give the same bits.

    All frames have one film (noise, blur and vignette), automatic exposure and motion blur. The lists and
    the truth are written first, so that the first frames can be read before the last one is rendered.

    Args:
        scene: a closed room.
        frames: number of frames, ``RATE_HZ`` a second.
        camera: camera of all frames.
        out: folder that is written.
        seed: seed of path, light, film and sensor.

    Raises:
        NoWalkError: the room has no such walk (``walk_poses``).
        InputError: ``frames`` is not positive, or the folder cannot be written.
    """
    folder = writable_folder(out)
    poses = walk_poses(scene, camera, frames, np.random.default_rng([seed, 29]))
    times_s = np.arange(frames) / RATE_HZ
    write_lists(folder, times_s)
    write_tum(folder / TRUE_POSES, times_s, poses)
    write_intrinsics(folder / "intrinsics.json", camera)
    vertices_m, triangles = world_mesh(scene)
    with atomic_path(folder / TRUTH) as temporary:
        np.savez_compressed(
            temporary, vertices_m=vertices_m, triangles=triangles, T_world_camera=np.array(poses)
        )
    renderer, rng = Renderer(scene, threads=1), np.random.default_rng([seed, 31])
    film = one_film(rng)
    for k, view in enumerate(photographs(renderer, camera, poses, 1, film, rng)):
        write_color(folder / image_file("rgb", k), view.rgb)
        _write_depth(folder / image_file("depth", k), sense_depth(view, camera, rng))


def read_truth(folder: AnyPath) -> WalkTruth:
    """Read the truth of a walk.

    Raises:
        InputError: the folder has no truth, or its file is damaged.
    """
    path = Path(folder) / TRUTH
    try:
        with np.load(path) as stored:
            return WalkTruth(stored["vertices_m"], stored["triangles"], stored["T_world_camera"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        raise InputError(f"{path} is missing or damaged; render the walk again") from None


def one_film(rng: Rng) -> Film:
    """Return a film that is the same for all photographs, drawn from the ranges of the usual film."""
    usual = Film()
    noise, blur_px, vignette = (rng.uniform(*of) for of in (usual.noise, usual.blur_px, usual.vignette))
    return Film(0.0, 0.0, (noise, noise), (blur_px, blur_px), (vignette, vignette))


def write_lists(folder: Path, times_s: FloatArray, color_suffix: str = ".png") -> None:
    """Write rgb.txt and depth.txt: the time (seconds) and the file of each of N images."""
    for kind, suffix in (("rgb", color_suffix), ("depth", ".png")):
        lines = [f"{time_s:.6f} {image_file(kind, k, suffix)}" for k, time_s in enumerate(times_s)]
        text = "\n".join([f"# {kind} images: time in seconds, file", *lines])
        with atomic_path(folder / f"{kind}.txt") as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")


def image_file(kind: str, index: int, suffix: str = ".png") -> str:
    """Return the name of an image, relative to the folder of its walk."""
    return f"{kind}/{index:06d}{suffix}"


def depth_units(depth: DepthMap) -> NDArray[np.uint16]:
    """Return (H, W) depth in units, ``UNITS_PER_METRE`` to a metre; 0 is unknown."""
    return np.rint(np.nan_to_num(depth.z_m) * UNITS_PER_METRE).astype(np.uint16)


def _write_depth(path: Path, depth: DepthMap) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(cv2.imencode(".png", depth_units(depth))[1].tobytes())
