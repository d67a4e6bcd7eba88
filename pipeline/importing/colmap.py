"""Import of COLMAP's text models: poses of photographs, with dense or measured depth.

Schönberger and Frahm, "Structure-from-Motion Revisited", CVPR 2016; https://colmap.github.io/format.html.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS, read_bytes, text_in
from pipeline.importing.cameras import camera_of
from pipeline.importing.sequence import DEPTH_SUFFIXES, Candidate, Sequence, named_inside
from pipeline.io.depth_scale import usual_scale
from pipeline.io.images import read_depth_units, read_depth_values
from pipeline.io.lenses import FISHEYE, lens_of
from pipeline.kernels.geometry import inverse, rigid
from pipeline.types import CameraIntrinsics, FloatArray

CENTRE_PX = 0.5
"""Coordinate of the first pixel's centre in COLMAP; here it is 0 (SPEC 1.1)."""
LEAST_POINTS = 20
"""Least number of points with measured depth that determine the model's scale."""
_PARAMETERS = {
    "SIMPLE_PINHOLE": ("fx", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("fx", "cx", "cy", "k1"),
    "RADIAL": ("fx", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "SIMPLE_RADIAL_FISHEYE": ("fx", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("fx", "cx", "cy", "k1", "k2"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
}
_DISTORTION = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_FISHEYE_DISTORTION = ("k1", "k2", "k3", "k4")
_MODEL_FOLDERS = (".", "sparse", "sparse/0")
_IMAGE_FOLDERS = ("images", "image", "color", "rgb", ".")
_DEPTH_FOLDERS = ("depth", "depths", "depth_images")


@dataclass(frozen=True, slots=True)
class _Image:
    """An image from two lines of images.txt."""

    camera: int
    name: str
    T_camera_model: FloatArray
    """(4, 4), in the model's unit."""
    points: str
    """X, Y and POINT3D_ID of each feature."""


def is_colmap(folder: Path) -> bool:
    """Return whether a folder contains a model's cameras and images, directly or in sparse/."""
    return _model_folder(folder, ".txt") is not None or _model_folder(folder, ".bin") is not None


def read_colmap(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the registered images with depth, of the camera that took most of them.

    Depth is read from ``stereo/depth_maps``, in the model's unit, or from a depth sensor's images in
    ``depth/`` with the names of the photographs, which then determine the model's scale.

    Raises:
        InputError: the model is binary or damaged, its camera model is not supported, or depth is missing.
    """
    model = _model_folder(folder, ".txt")
    if model is None:
        binary = _model_folder(folder, ".bin")
        raise InputError(
            f"The model in {binary} is binary; try colmap model_converter --input_path {binary} "
            f"--output_path {binary} --output_type TXT"
        )
    (cameras, others), images = _cameras(model / "cameras.txt"), list(_images(model / "images.txt"))
    found = _with_depth(folder, images)
    most, _ = Counter(image.camera for image, _, _ in found).most_common(1)[0]
    ours = sorted((one for one in found if one[0].camera == most), key=lambda one: one[0].name)
    notes = list[str]()
    if intrinsics is not None:
        camera, _ = camera_of(folder, ours[0][1], intrinsics, None, "")
    elif most in cameras:
        camera = cameras[most]
    else:
        raise _no_camera(model / "cameras.txt", most, others)
    if len(ours) < len(images):
        notes.append(
            f"{len(images) - len(ours)} of {len(images)} images have no file, no depth or another camera"
        )
    dense = ours[0][2].suffix == ".bin"
    if dense:
        units, metres = 1.0, 1.0
        notes.append(
            "COLMAP knows no metres: its unit is taken as one; --depth-scale says how many units a metre has"
        )
    else:
        units = usual_scale(read_depth_values(ours[0][2]))
        metres = _metres_a_unit(
            model / "points3D.txt", [(image, depth) for image, _, depth in ours], camera, units
        )
        notes.append(f"A unit of the model is {metres:.4g} m by the depth that was measured at its points")
    candidates = []
    for image, color, depth in ours:
        T_model_camera = inverse(image.T_camera_model)
        T_model_camera[:3, 3] *= metres
        candidates.append(Candidate(color, depth, T_model_camera))
    return Sequence(tuple(candidates), camera, units, poses_in_depth_units=True, notes=tuple(notes))


def _with_depth(folder: Path, images: list[_Image]) -> list[tuple[_Image, Path, Path]]:
    """Return the images whose photograph and depth exist, with both files."""
    photographed = [
        (image, color) for image in images if (color := _beside(folder, _IMAGE_FOLDERS, image.name))
    ]
    found = [(image, color, depth) for image, color in photographed if (depth := _depth(folder, image.name))]
    if not photographed:
        example = f", such as {images[0].name}" if images else ""
        raise InputError(
            f"{folder} has none of the {len(images)} photographs of images.txt{example}; try to put "
            "them in images/"
        )
    if not found:
        raise InputError(
            f"{folder} has photographs of images.txt but depth of none; try colmap patch_match_stereo, which "
            "writes stereo/depth_maps, or put the sensor's images of the same names in depth/"
        )
    return found


def _no_camera(file: Path, camera: int, others: dict[int, str]) -> InputError:
    """Return the error of a camera that images.txt names and that cannot be used."""
    if camera not in others:
        return InputError(f"{file} has no camera {camera}, which images.txt names; check both")
    return InputError(
        f"Camera {camera} of {file} has the model {others[camera]}, which is not read; try colmap "
        "image_undistorter, whose cameras are PINHOLE, or --intrinsics FILE"
    )


def read_depth_map(path: Path) -> FloatArray:
    """Read an (H, W) depth map from ``stereo/depth_maps``, in the model's unit; 0 where it is unknown.

    Raises:
        InputError: it is damaged, too large, has several channels or no depth.
    """
    data = read_bytes(path, MAX_IMAGE_BYTES, "depth map")
    words = data[:64].split(b"&", 3)
    sizes = [int(word) for word in words[:3] if word.isdigit()]
    if len(words) < 4 or len(sizes) < 3 or sizes[2] != 1 or not 0 < sizes[0] * sizes[1] <= MAX_IMAGE_PIXELS:
        raise InputError(f"{path} is no depth map of COLMAP, such as 640&480&1& and numbers; check the file")
    width_px, height_px, start = sizes[0], sizes[1], sum(len(word) + 1 for word in words[:3])
    if len(data) - start != 4 * width_px * height_px:
        raise InputError(f"The depth map {path} is truncated or damaged; try to copy it again")
    values = np.frombuffer(data, "<f4", offset=start).reshape(height_px, width_px)
    known = np.isfinite(values) & (values > 0.0)
    if not known.any():
        raise InputError(f"The depth map {path} has no depth anywhere; try another image")
    return np.where(known, values, 0.0)


def _metres_a_unit(
    file: Path, frames: list[tuple[_Image, Path]], camera: CameraIntrinsics, units_per_metre: float
) -> float:
    """Return the metres per unit of the model: median ratio of measured depth to depth of model points."""
    points = _points(file)
    ratios = [np.empty(0)]
    for image, depth in frames[:: -(-len(frames) // 20)]:
        features = _numbers(image.points.split(), 3, file.with_name("images.txt"))
        seen = [(x, y, points[int(which)]) for x, y, which in features if int(which) in points]
        if not seen:
            continue
        places = np.array([point for _, _, point in seen])
        z = (places @ image.T_camera_model[:3, :3].T + image.T_camera_model[:3, 3])[:, 2]
        units = read_depth_units(depth)
        height_px, width_px = units.shape
        shares = height_px / camera.height_px, width_px / camera.width_px
        places_px = np.array([(y, x) for x, y, _ in seen]) * shares
        pixels = places_px.astype(int)  # COLMAP's pixel 0 extends from 0 to 1
        inside = ((pixels >= 0) & (pixels < (height_px, width_px))).all(axis=1) & (z > 0)
        measured = units[tuple(pixels[inside].T)] / units_per_metre
        ratios.append((measured / z[inside])[measured > 0])
    known = np.concatenate(ratios)
    if len(known) < LEAST_POINTS:
        raise InputError(
            f"Only {len(known)} points of {file} have measured depth, too few to tell how long a unit of the "
            "model is; try a model of more images"
        )
    return float(np.median(known))


def _cameras(file: Path) -> tuple[dict[int, CameraIntrinsics], dict[int, str]]:
    """Read the cameras with supported models, and the names of the other models, by their ids."""
    cameras, others = dict[int, CameraIntrinsics](), dict[int, str]()
    for line in _lines(file):
        words = line.split()
        names = _PARAMETERS.get(words[1] if len(words) > 1 else "")
        if names is None:
            if len(words) > 1 and words[0].isdigit():
                others[int(words[0])] = words[1]
            continue
        (row,) = _numbers([words[0], *words[2:]], 3 + len(names), file)
        given = dict(zip(names, row[3:], strict=True))
        fx, fy = given["fx"], given.get("fy", given["fx"])
        pinhole = CameraIntrinsics.pinhole(
            fx, fy, given["cx"] - CENTRE_PX, given["cy"] - CENTRE_PX, int(row[1]), int(row[2])
        )
        fisheye = words[1].endswith("FISHEYE")
        lens = [given.get(name, 0.0) for name in (_FISHEYE_DISTORTION if fisheye else _DISTORTION)]
        distortion = lens_of(FISHEYE if fisheye else "", np.array(lens))
        assert distortion is not None  # all models of _PARAMETERS are supported
        cameras[int(row[0])] = replace(pinhole, distortion=distortion, fisheye=fisheye)
    if not cameras and not others:
        raise InputError(f"{file} has no line of a camera; try to export the model again")
    return cameras, others


def _images(file: Path) -> Iterator[_Image]:
    """Yield the images: each has two lines, of which the second may be empty."""
    lines = [line for line in _text(file).splitlines() if not line.startswith("#")]
    for line, points in zip(lines[::2], [*lines[1::2], ""], strict=False):
        words = line.split(maxsplit=9)
        if len(words) < 10:
            raise InputError(f"{file} has the line '{line[:80]}' where an image is expected; check the file")
        (row,) = _numbers(words[:9], 9, file)
        quaternion = row[1:5]
        if np.linalg.norm(quaternion) < 0.5:
            raise InputError(f"{file} has no rotation for {words[9]}; check the file")
        rotation = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
        yield _Image(int(row[8]), words[9].strip(), rigid(rotation, row[5:8]), points)


def _points(file: Path) -> dict[int, FloatArray]:
    """Read (3,) positions of the points by their ids, in the model's unit."""
    rows = [line.split(maxsplit=4)[:4] for line in _lines(file)]
    values = _numbers([word for row in rows for word in row], 4, file)
    return {int(row[0]): row[1:] for row in values}


def _lines(file: Path) -> Iterator[str]:
    return (line for line in _text(file).splitlines() if line.strip() and not line.startswith("#"))


def _text(file: Path) -> str:
    return text_in(read_bytes(file, MAX_GEOMETRY_BYTES, "part of a COLMAP model"), "replace")


def _numbers(words: list[str], columns: int, file: Path) -> FloatArray:
    """Convert words to (N, columns) numbers."""
    try:
        values = np.array(words, dtype=np.float64).reshape(-1, columns)
    except ValueError:
        raise InputError(
            f"{file} has words or too few numbers where numbers belong; check the file"
        ) from None
    if not np.isfinite(values).all():
        raise InputError(f"{file} has numbers that are not finite; check the file")
    return values


def _model_folder(folder: Path, suffix: str) -> Path | None:
    names = [f"{name}{suffix}" for name in ("cameras", "images")]
    places = (folder / place for place in _MODEL_FOLDERS)
    return next((place for place in places if all((place / name).is_file() for name in names)), None)


def _beside(folder: Path, places: tuple[str, ...], name: str) -> Path | None:
    """Find a file in the first of several subfolders that has it; None if no subfolder has it."""
    named_inside(folder, name, "images.txt")
    return next((path for place in places if (path := folder / place / name).is_file()), None)


def _depth(folder: Path, name: str) -> Path | None:
    dense = (f"{name}.{kind}.bin" for kind in ("geometric", "photometric"))
    maps = (_beside(folder, ("stereo/depth_maps",), file) for file in dense)
    measured = (_beside(folder, _DEPTH_FOLDERS, str(Path(name).with_suffix(kind))) for kind in DEPTH_SUFFIXES)
    return next((path for path in (*maps, *measured) if path), None)
