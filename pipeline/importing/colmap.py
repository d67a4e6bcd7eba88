"""Import of COLMAP's models, text or binary: poses of photographs, with dense or measured depth.

Schönberger and Frahm, "Structure-from-Motion Revisited", CVPR 2016; https://colmap.github.io/format.html.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS, read_bytes
from pipeline.importing.cameras import camera_of
from pipeline.importing.colmap_binary import read_binary_model
from pipeline.importing.colmap_model import Model, ModelImage, read_text_model
from pipeline.importing.depth_views import first_depth_values
from pipeline.importing.sequence import DEPTH_SUFFIXES, Candidate, Sequence, named_inside
from pipeline.io.depth_scale import usual_scale
from pipeline.io.images import NoDepthError, read_depth_units
from pipeline.io.intrinsics import check_camera
from pipeline.kernels.geometry import inverse
from pipeline.types import CameraIntrinsics, FloatArray

LEAST_POINTS = 20
"""Least number of points with measured depth that determine the model's scale."""
_MODEL_FOLDERS = (".", "sparse", "sparse/0")
_IMAGE_FOLDERS = ("images", "image", "color", "rgb", ".")
_DEPTH_FOLDERS = ("depth", "depths", "depth_images")


def is_colmap(folder: Path) -> bool:
    """Return whether a folder contains a model's cameras and images, directly or in sparse/."""
    return _model_folder(folder, ".txt") is not None or _model_folder(folder, ".bin") is not None


def read_colmap(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the registered images with depth; with ``intrinsics``, only those of the most frequent camera.

    Depth is read from ``stereo/depth_maps``, in the model's unit, or from a depth sensor's images in
    ``depth/`` with the names of the photographs, which then determine the model's scale.

    Raises:
        InputError: the model is damaged, its camera model is not supported, depth is missing, or some images
            have dense and others measured depth.
    """
    text, binary = (_model_folder(folder, suffix) for suffix in (".txt", ".bin"))
    if text is not None:
        model = read_text_model(text)
    else:
        assert binary is not None
        model = read_binary_model(binary)
    found = _with_depth(folder, model)
    most, _ = Counter(image.camera for image, _, _ in found).most_common(1)[0]
    usable = {most} if intrinsics else model.cameras.keys()
    ours = sorted((one for one in found if one[0].camera in usable), key=lambda one: one[0].name)
    if not ours:
        raise _no_camera(model, most)
    cameras, notes = model.cameras, list[str]()
    if intrinsics is not None:
        cameras = {most: camera_of(folder, ours[0][1], intrinsics, None, "")[0]}
    for number in sorted({image.camera for image, _, _ in ours}):
        check_camera(f"Camera {number} of {model.files['cameras']}", cameras[number])
    camera = cameras.get(most, cameras[ours[0][0].camera])
    total = len(model.images)
    if len(ours) < total:
        notes.append(
            f"{total - len(ours)} of {total} images have no file, no depth or no camera that is read"
        )
    if _is_dense(folder, [depth for _, _, depth in ours]):
        units, metres, noted = 1.0, 1.0, _noted_dense
    else:
        units = usual_scale(first_depth_values(folder, (depth for _, _, depth in ours)))
        metres = _metres_a_unit(model, [(image, depth) for image, _, depth in ours], cameras, units)
        noted = partial(_noted_measured, units * metres)
    candidates = []
    for image, color, depth in ours:
        T_model_camera = inverse(image.T_camera_model)
        T_model_camera[:3, 3] *= metres
        own = cameras[image.camera] if len(cameras) > 1 else None
        candidates.append(Candidate(color, depth, T_model_camera, camera=own))
    return Sequence(
        tuple(candidates), camera, units, poses_in_depth_units=True, notes=tuple(notes), completed=noted
    )


def _is_dense(folder: Path, depths: list[Path]) -> bool:
    """Return whether depth images are COLMAP's own maps, in the model's unit, and not a sensor's.

    Raises:
        InputError: only some are.
    """
    dense = sum(depth.suffix == ".bin" for depth in depths)
    if 0 < dense < len(depths):
        raise InputError(
            f"{folder} has stereo/depth_maps for {dense} of {len(depths)} images and a sensor's depth for "
            "the others, which have different units; try to move one of the two folders away"
        )
    return dense > 0


def _noted_dense(sequence: Sequence) -> Sequence:
    """Return the sequence with a note on the model's unit, unless the user gave the scale."""
    if sequence.scale_stated:
        return sequence
    note = (
        "COLMAP's models have no scale: one unit is read as one metre; --depth-scale says how many units a "
        "metre has"
    )
    return replace(sequence, notes=(*sequence.notes, note))


def _noted_measured(depth_units: float, sequence: Sequence) -> Sequence:
    """Return the sequence with a note on the model's unit: ``depth_units`` units of the depth images."""
    metres = depth_units / sequence.units_per_metre
    note = f"A unit of the model is {metres:.4g} m by the depth that was measured at its points"
    return replace(sequence, notes=(*sequence.notes, note))


def _with_depth(folder: Path, model: Model) -> list[tuple[ModelImage, Path, Path]]:
    """Return the images whose photograph and depth exist, with both files.

    Raises:
        InputError: there is none.
    """
    images, listed = model.images, model.files["images"].name
    photographed = [
        (image, color) for image in images if (color := _file_in(folder, _IMAGE_FOLDERS, image.name, listed))
    ]
    found = [
        (image, color, depth)
        for image, color in photographed
        if (depth := _depth(folder, image.name, listed))
    ]
    if not photographed:
        example = f", such as {images[0].name}" if images else ""
        raise InputError(
            f"{folder} has none of the {len(images)} photographs of {listed}{example}; try to put "
            "them in images/"
        )
    if not found:
        raise InputError(
            f"{folder} has photographs of {listed} but depth of none; try colmap patch_match_stereo, which "
            "writes stereo/depth_maps, or put the sensor's images of the same names in depth/"
        )
    return found


def _no_camera(model: Model, camera: int) -> InputError:
    """Return the error for a camera that images use and that cannot be read."""
    file = model.files["cameras"]
    if camera not in model.others:
        listed = model.files["images"].name
        return InputError(f"{file} has no camera {camera}, which {listed} names; check both")
    return InputError(
        f"Camera {camera} of {file} has the model {model.others[camera]}, which is not read; try colmap "
        "image_undistorter, whose cameras are PINHOLE, or --intrinsics FILE"
    )


def read_depth_map(path: Path) -> FloatArray:
    """Read an (H, W) depth map from ``stereo/depth_maps``, in the model's unit; 0 where it is unknown.

    Raises:
        InputError: it is damaged, too large or has several channels; NoDepthError if it has no depth.
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
        raise NoDepthError(f"The depth map {path} has no depth anywhere; try another image")
    return np.where(known, values, 0.0)


def _metres_a_unit(
    model: Model,
    frames: list[tuple[ModelImage, Path]],
    cameras: dict[int, CameraIntrinsics],
    units_per_metre: float,
) -> float:
    """Return the metres per unit of the model: median ratio of measured depth to depth of model points.

    Raises:
        InputError: fewer than ``LEAST_POINTS`` points have measured depth.
    """
    points = model.points()
    ratios = [np.empty(0)]
    for image, depth in frames[:: -(-len(frames) // 20)]:
        seen = [(x, y, points[int(which)]) for x, y, which in image.features() if int(which) in points]
        if not seen:
            continue
        places = np.array([point for _, _, point in seen])
        z = (places @ image.T_camera_model[:3, :3].T + image.T_camera_model[:3, 3])[:, 2]
        try:
            units = read_depth_units(depth)
        except NoDepthError:
            continue
        height_px, width_px = units.shape
        camera = cameras[image.camera]
        shares = height_px / camera.height_px, width_px / camera.width_px
        places_px = np.array([(y, x) for x, y, _ in seen]) * shares
        pixels = places_px.astype(int)  # COLMAP's pixel 0 extends from 0 to 1
        inside = ((pixels >= 0) & (pixels < (height_px, width_px))).all(axis=1) & (z > 0)
        measured = units[tuple(pixels[inside].T)] / units_per_metre
        ratios.append((measured / z[inside])[measured > 0])
    known = np.concatenate(ratios)
    if len(known) < LEAST_POINTS:
        raise InputError(
            f"Only {len(known)} points of {model.files['points3D']} have measured depth, too few to tell how "
            "long a unit of the model is; try a model of more images"
        )
    return float(np.median(known))


def _model_folder(folder: Path, suffix: str) -> Path | None:
    names = [f"{name}{suffix}" for name in ("cameras", "images")]
    places = (folder / place for place in _MODEL_FOLDERS)
    return next((place for place in places if all((place / name).is_file() for name in names)), None)


def _file_in(folder: Path, places: tuple[str, ...], name: str, listed: str) -> Path | None:
    """Return a file that ``listed`` names, in the first subfolder of ``places`` that has it; else None."""
    named_inside(folder, name, listed)
    return next((path for place in places if (path := folder / place / name).is_file()), None)


def _depth(folder: Path, name: str, listed: str) -> Path | None:
    dense = (f"{name}.{kind}.bin" for kind in ("geometric", "photometric"))
    maps = (_file_in(folder, ("stereo/depth_maps",), file, listed) for file in dense)
    measured = (
        _file_in(folder, _DEPTH_FOLDERS, str(Path(name).with_suffix(kind)), listed) for kind in DEPTH_SUFFIXES
    )
    return next((path for path in (*maps, *measured) if path), None)
