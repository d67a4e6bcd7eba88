"""Writes the calibration that is shown as a folder that the chain lays over the rig."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

from app.screens.calibrate.bias import bias_of
from app.screens.calibrate.cameras import cameras_of, finished
from app.screens.calibrate.view import CameraView, RigView
from app.state import Spec
from app.store import Store
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.io.calibrations import CalibratedNode, write_calibration
from pipeline.io.depth_correction import FILE_NAME, write_depth_correction
from pipeline.sources import Calibrated
from pipeline.types import CameraIntrinsics, FloatArray, Rig

CHAIN_LENSES = ("thesis", "brown")
"""Those that the chain can undo."""


def use_job(store: Store, spec: Spec, folder: str) -> Generator[Progress, None, str]:
    """Write the cameras, where they stand if all were placed together, and the correction of their depth
    where it is known. The first camera stays where the rig has it.

    Returns:
        The folder.

    Raises:
        InputError: no camera has a lens, a lens is one that the chain does not know, or the cameras are not
            those of the rig.
    """
    views, source = spec.views, spec.source
    assert views is not None
    before = replace(spec, source=source.source if isinstance(source, Calibrated) else source)
    rig: Rig = yield from store.stage(before, "rig")
    known = yield from finished(cameras_of(store, views))
    cameras = [camera for camera in known.cameras if camera.calibration is not None]
    if not cameras:
        raise InputError("No camera is calibrated yet; add views of the board first")
    for camera in cameras:
        _check(camera, rig)
    poses = _poses(known.rig, rig) if isinstance(known.rig, RigView) else {}
    write_calibration(
        folder, {one.name: CalibratedNode(_intrinsics(one), poses.get(one.name)) for one in cameras}
    )
    for index, camera in enumerate(cameras):
        found = yield from bias_of(store, views, camera, index / len(cameras))
        if not isinstance(found, str):
            write_depth_correction(Path(folder) / camera.name / FILE_NAME, found.correction)
    return folder


def _poses(placed: RigView, rig: Rig) -> dict[str, FloatArray]:
    """(4, 4) T_world_camera by name; none unless all nodes were placed: others would be in another world."""
    believed = {frame.name: frame.T_world_camera for frame in rig.frames}
    found = {one.name: one.T_first_camera for one in placed.cameras}
    if set(found) != set(believed):
        return {}
    T_world_first = believed[placed.cameras[0].name]
    return {name: T_world_first @ T for name, T in found.items()}


def _intrinsics(camera: CameraView) -> CameraIntrinsics:
    lens = camera.calibration
    assert lens is not None
    return CameraIntrinsics(lens.matrix, lens.distortion[:5].copy(), *lens.size_px)


def _check(camera: CameraView, rig: Rig) -> None:
    """Raise InputError where the chain cannot take a camera."""
    lens = camera.calibration
    assert lens is not None
    sizes_px = {frame.name: (frame.intrinsics.width_px, frame.intrinsics.height_px) for frame in rig.frames}
    if camera.name not in sizes_px:
        raise InputError(
            f"The scene has no {camera.name}, only {', '.join(sizes_px)}; choose under 'Taken by' whose "
            "photographs these are"
        )
    if sizes_px[camera.name] != lens.size_px:
        (width, height), (own_width, own_height) = sizes_px[camera.name], lens.size_px
        raise InputError(
            f"{camera.name} of the scene has {width} x {height} pixels and the photographs {own_width} x "
            f"{own_height}; a calibration is good for one size only"
        )
    if lens.lens not in CHAIN_LENSES:
        raise InputError(
            f"The chain knows no {lens.lens} lens; choose {' or '.join(CHAIN_LENSES)} under Advanced to use "
            "it"
        )
