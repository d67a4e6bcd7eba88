"""Import of Matroska recordings of Azure Kinect and of Orbbec's Femto cameras with the same programs.

https://learn.microsoft.com/azure/kinect-dk/record-file-format; the cameras of each mode are those of the
Azure Kinect Sensor SDK (mode_specific_calibration.c).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from packetmesh.files import json_object, text_in
from pipeline.importing.cameras import camera_of
from pipeline.importing.pairing import require
from pipeline.importing.sequence import Candidate, Sequence, posed
from pipeline.importing.stored import StoredImage
from pipeline.importing.tum import associate
from pipeline.importing.video import Contents, Track, TrackReader, contents_of
from pipeline.io.images import color_in
from pipeline.io.intrinsics import check_camera
from pipeline.io.poses import nearest_rigid
from pipeline.kernels.geometry import inverse, rigid
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray

CALIBRATION = "calibration.json"
_DEPTH_TAG = "b16g"
"""FFmpeg's tag of 16-bit grey, big-endian."""
_DEPTH_MODES = {
    (320, 288): (512, (96, 90)),
    (640, 576): (1024, (192, 180)),
    (512, 512): (512, (0, 0)),
    (1024, 1024): (1024, (0, 0)),
}
"""By width and height of the images: side of the square sensor, and its first column and row in them."""
_RAW_COLORS = {"BGRA": 4.0, "NV12": 1.5, "YUY2": 2.0}
"""Bytes of a pixel by the tag of the colour track."""
_MODEL = "CALIBRATION_LensDistortionModelBrownConrady"
_CUT_S = 1.0
"""A file whose images end so long before its stated duration is cut off."""


def read_kinect(file: Path, intrinsics: Path | None) -> Sequence:
    """Read pairs of colour and depth images less than 20 ms apart; depth in millimetres, of its own camera.

    Raises:
        InputError: the file lacks a track or the calibration, or one of them has another form.
    """
    contents = contents_of(file)
    color, depth = _tracks(file, contents)
    cameras, T_color_depth = _calibration(file, contents, color, depth)
    near = associate(color.times_s, depth.times_s)
    require(near, file, "a colour and a depth image less than 20 ms apart")
    reader = TrackReader(file, (color, depth), decoded=False)
    candidates, without, notes = posed(
        [
            Candidate(
                StoredImage(file, f"colour image {i}", partial(_color, reader, color, i, file)),
                StoredImage(file, f"depth image {j}", partial(_depth, reader, depth, j, file)),
                time_s=float(color.times_s[i]),
            )
            for i, j in near
        ],
        f"pose in {file.name}",
    )
    end_s = max(color.times_s[-1], depth.times_s[-1])
    if end_s + _CUT_S < contents.duration_s:
        notes += (
            f"{file} is cut: it ends at {end_s:.1f} s of its {contents.duration_s:.1f} s; try to copy it "
            "again",
        )
    camera = cameras[0]
    if intrinsics:
        camera, _ = camera_of(file.parent, candidates[0].color, intrinsics, None, "")
    return Sequence(
        candidates,
        camera,
        depth_camera=cameras[1],
        T_color_depth=T_color_depth,
        without_poses=without,
        notes=notes,
    )


def _tracks(file: Path, contents: Contents) -> tuple[Track, Track]:
    """Return the tracks of colour and depth."""
    named = {track.title: track for track in contents.tracks}
    for title, what in (("COLOR", "colour"), ("DEPTH", "depth")):
        if title not in named:
            names = ", ".join(named) or "none"
            raise InputError(
                f"{file} has no {what} track {title} of an Azure Kinect or Femto (its tracks: {names}); try "
                "to record with k4arecorder, with colour on and a depth mode other than PASSIVE_IR"
            )
        if not named[title].stamps:
            raise InputError(f"{file} has no {what} image; try to copy it again, or to record longer")
    color, depth = named["COLOR"], named["DEPTH"]
    if depth.tag != _DEPTH_TAG:
        raise InputError(
            f"The depth track of {file} has another or an unknown compression, not {_DEPTH_TAG}; try the "
            "file as k4arecorder wrote it"
        )
    if color.codec != "mjpeg" and color.tag not in _RAW_COLORS:
        raise InputError(
            f"The colour track of {file} has another or an unknown compression, not MJPG, "
            f"{' or '.join(_RAW_COLORS)}; try the file as k4arecorder wrote it"
        )
    return color, depth


def _calibration(
    file: Path, contents: Contents, color: Track, depth: Track
) -> tuple[tuple[CameraIntrinsics, CameraIntrinsics], FloatArray]:
    """Return the cameras of colour and depth, and (4, 4) T_color_depth, metres."""
    if CALIBRATION not in contents.attachments:
        raise InputError(
            f"{file} has no attached {CALIBRATION}, without which depth cannot be placed in the colour "
            "image; try the file as k4arecorder wrote it"
        )
    name = f"{CALIBRATION} in {file}"
    values = json_object(
        text_in(contents.attachments[CALIBRATION].rstrip(b"\0"), "replace"), name, "calibration"
    )
    try:
        cameras = {one["Purpose"]: one for one in values["CalibrationInformation"]["Cameras"]}
        of_color = cameras["CALIBRATION_CameraPurposePhotoVideo"]
        of_depth = cameras["CALIBRATION_CameraPurposeDepth"]
        lenses = _color_camera(of_color, color), _depth_camera(of_depth, depth)
        places = [nearest_rigid(_place(one)) for one in (of_color, of_depth)]
    except (KeyError, TypeError, ValueError, OverflowError, IndexError) as error:
        raise InputError(
            f"The calibration {name} is not in Azure Kinect's format ({error}); try the file as k4arecorder "
            "wrote it"
        ) from None
    for lens, what in zip(lenses, ("colour", "depth"), strict=True):
        check_camera(f"The {what} camera of {name}", lens)
    T_color_world, T_depth_world = places
    if T_color_world is None or T_depth_world is None:
        raise InputError(f"A pose of {name} is no rigid transform; try the file as k4arecorder wrote it")
    return lenses, T_color_world @ inverse(T_depth_world)


def _color_camera(values: Mapping[str, Any], track: Track) -> CameraIntrinsics:
    """Return the camera of a colour mode: images of all columns and the middle rows of a 4 : 3 sensor.

    Raises:
        ValueError: the sensor or the images have other proportions.
    """
    cx, cy, fx, fy = _unit_lens(values)
    width_px, height_px = track.width_px, track.height_px
    rows = 0.75 * width_px
    sensor_px = values["SensorWidth"], values["SensorHeight"]
    if sensor_px[0] * 9 == sensor_px[1] * 16:  # an old calibration, of the middle rows
        cy, fy = 0.75 * cy + 0.125, 0.75 * fy
    elif sensor_px[0] * 3 != sensor_px[1] * 4:
        raise ValueError(f"a colour sensor of {sensor_px[0]} x {sensor_px[1]}")
    top = (rows - height_px) / 2.0
    if top < 0.0:
        raise ValueError(f"colour of {width_px} x {height_px}")
    return _camera(values, (fx * width_px, fy * rows, cx * width_px, cy * rows - top), track)


def _depth_camera(values: Mapping[str, Any], track: Track) -> CameraIntrinsics:
    """Return the camera of the depth mode with this size of images.

    Raises:
        ValueError: no mode has this size.
    """
    size_px = track.width_px, track.height_px
    if size_px not in _DEPTH_MODES:
        raise ValueError(f"depth of {size_px[0]} x {size_px[1]}")
    whole, (left, top) = _DEPTH_MODES[size_px]
    cx, cy, fx, fy = _unit_lens(values)
    return _camera(values, (fx * whole, fy * whole, cx * whole - left, cy * whole - top), track)


def _unit_lens(values: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """Return cx, cy, fx and fy as shares of the sensor's sides; (0, 0) is the corner of the first pixel."""
    if values["Intrinsics"]["ModelType"] != _MODEL:
        raise ValueError(values["Intrinsics"]["ModelType"])
    cx, cy, fx, fy = map(float, values["Intrinsics"]["ModelParameters"][:4])
    return cx, cy, fx, fy


def _camera(
    values: Mapping[str, Any], lens_px: tuple[float, float, float, float], track: Track
) -> CameraIntrinsics:
    """Return the camera of fx, fy, cx, cy, with (0, 0) at the first pixel's corner, and its distortion."""
    fx, fy, cx, cy = lens_px
    pinhole = CameraIntrinsics.pinhole(fx, fy, cx - 0.5, cy - 0.5, track.width_px, track.height_px)
    k1, k2, k3, k4, k5, k6, _, _, p2, p1 = map(float, values["Intrinsics"]["ModelParameters"][4:14])
    distortion = np.array([k1, k2, p1, p2, k3, k4, k5, k6])
    return CameraIntrinsics(pinhole.matrix, distortion, track.width_px, track.height_px)


def _place(values: Mapping[str, Any]) -> FloatArray:
    """Return the (4, 4) transform from the device's frame to a camera's, metres."""
    rotation = np.array(values["Rt"]["Rotation"], np.float64).reshape(3, 3)
    return rigid(rotation, np.array(values["Rt"]["Translation"], np.float64).reshape(3))


def _color(reader: TrackReader, track: Track, number: int, file: Path) -> ByteArray:
    """Read (H, W, 3) RGB."""
    data, name = reader.packet(track, number), f"colour image {number} in {file}"
    if track.codec == "mjpeg":
        return color_in(data, name)
    width_px, height_px = track.width_px, track.height_px
    if len(data) != round(_RAW_COLORS[track.tag] * width_px * height_px):
        raise InputError(f"The {name} is truncated or damaged; try to copy the file again")
    values = np.frombuffer(data, np.uint8)
    if track.tag == "BGRA":
        return np.ascontiguousarray(values.reshape(height_px, width_px, 4)[..., 2::-1])
    if track.tag == "NV12":
        return cv2.cvtColor(values.reshape(-1, width_px), cv2.COLOR_YUV2RGB_NV12)
    return cv2.cvtColor(values.reshape(height_px, width_px, 2), cv2.COLOR_YUV2RGB_YUY2)


def _depth(reader: TrackReader, track: Track, number: int, file: Path) -> NDArray[np.uint16]:
    """Read (H, W) depth, millimetres."""
    data = reader.packet(track, number)
    if len(data) != 2 * track.width_px * track.height_px:
        raise InputError(
            f"The depth image {number} in {file} is truncated or damaged; try to copy the file again"
        )
    return np.frombuffer(data, ">u2").reshape(track.height_px, track.width_px).astype(np.uint16)
